"""razy-report on small manifests, and the manifest of the source."""

import json
import os
import re

import pytest
from programs import BUILD, SOURCE, call

CASE = """&scene kind='lumped', title='Free vibration' /
&mass name='block', value=1.0 /
&spring between='block','frame', stiffness=100.0 /
&initial on='block', displacement=1.0 /
&motion t_end=1.0, start='given' /
&record observable='state', what='trajectory', interval=0.01 /
"""
MANIFEST = """title = "Two items"
[[item]]
name = "First"
caption = "A vibration & its size"
expected = "agrees with the source"
[[item.case]]
name = "one"
input = "case.nml"
program = "run"
[[item.case]]
name = "two"
input = "case.nml"
program = "run"
set = ["initial%displacement=2"]
[[item.plot]]
cases = ["one", "two"]
kind = "phase"
[[item.number]]
text = "largest displacement (m)"
dataset = "/state/displacement"
reduce = "max"
should_be = 1.0
tolerance = 1e-9
quote = "the amplitude is 1 m"
[[item.number]]
text = "twice that"
case = "two"
dataset = "/state/displacement"
reduce = "max"
over = "one"
reduced = true
should_be = 2.0
tolerance = 1e-9
[[item]]
name = "Second"
caption = "Another"
[[item.case]]
input = "case.nml"
program = "run"
[[item.number]]
text = "a wrong claim"
dataset = "/state/displacement"
at_least = 5.0
quote = "it exceeds 5 m"
"""


def report(*arguments):
    return call("razy.report.cli", *arguments, "--programs", BUILD / "bin")


def written(folder, manifest=MANIFEST):
    (folder / "case.nml").write_text(CASE)
    (folder / "report.toml").write_text(manifest)
    return folder


def test_page_and_pdf_say_what_agrees(folder):
    done = report(written(folder), "--output", "out")
    assert done.returncode == 0, done.stderr
    page = (folder / "out/report.html").read_text()
    assert page.count("data:image/png;base64,") == 1
    assert "1 agrees with the source, 1 contradicts" in page
    assert "“the amplitude is 1 m”" in page
    assert "<td>yes<td>the source" in page and "<td>yes<td>razy" in page
    assert "<td>no<td>the source" in page
    assert "A vibration &amp; its size" in page
    assert "src='http" not in page
    pdf = (folder / "out/report.pdf").read_bytes()
    assert pdf.startswith(b"%PDF")
    # The verdicts, and both items below each other.
    assert pdf.count(b"/Type /Page ") == 2
    assert b"/Type0" in pdf and b"/Type3" not in pdf
    assert len(list((folder / "out/cases").glob("*.h5"))) == 2


def test_programs_are_those_that_are_named(folder, monkeypatch):
    """Not others where the folder that is named has none; RAZY_BIN names one, too."""
    (written(folder) / "empty").mkdir()
    monkeypatch.setenv("PATH", f"{BUILD / 'bin'}:{os.environ['PATH']}")
    done = call("razy.report.cli", "--output", "out", ".", "--programs", "empty")
    assert (done.returncode, "there is no program razy-run in this folder" in done.stderr) == (2, True)
    monkeypatch.setenv("RAZY_BIN", "empty")
    assert call("razy.report.cli", "--output", "out", ".").returncode == 2
    monkeypatch.setenv("RAZY_BIN", str(BUILD / "bin"))
    monkeypatch.setenv("PATH", "")
    assert call("razy.report.cli", "--output", "out", ".").returncode == 0


def test_what_is_done_is_kept_and_what_changed_is_not(folder):
    report(written(folder), "--output", "out")
    assert report(folder, "--output", "out").stdout.count(": kept") == 2
    (folder / "case.nml").write_text(CASE.replace("100.0", "101.0"))
    assert report(folder, "--output", "out").stdout.count(": kept") == 0


def test_a_failed_case_is_shown_and_the_others_are_done(folder):
    broken = CASE.replace("100.0", "100.0").replace("t_end=1.0", "t_end=1.0, max_steps=1, integrator='rk4', step=1e-3")
    (folder / "broken.nml").write_text(broken)
    manifest = MANIFEST.replace('input = "case.nml"', 'input = "broken.nml"', 1)
    done = report(written(folder, manifest), "--output", "out")
    assert done.returncode == 1
    page = (folder / "out/report.html").read_text()
    assert "1 contradicts, 1 failed" in page
    notes = [json.loads(path.read_text()) for path in (folder / "out/cases").glob("*.json")]
    assert sum(bool(note["problem"]) for note in notes) == 1


def test_what_failed_is_computed_again(folder):
    written(folder)
    # A name that is taken by a folder is a disk that cannot be written, for a while.
    assert report(folder, "--output", "out").returncode == 0
    results = sorted((folder / "out/cases").glob("*.h5"))
    for result in results:
        result.unlink()
        result.mkdir()
    notes = [path.with_suffix(".json") for path in results]
    for note in notes:
        note.unlink()
    assert report(folder, "--output", "out").returncode == 1
    for result in results:
        result.rmdir()
    assert report(folder, "--output", "out").returncode == 0


def test_a_verdict_that_turns_fails(folder):
    manifest = MANIFEST.replace("should_be = 1.0", "should_be = 3.0")
    done = report(written(folder, manifest), "--output", "out")
    assert done.returncode == 1
    assert "First: contradicts, expected agrees with the source" in done.stderr


def sized(*numbers, verdict=""):
    """Return a manifest of one item: (quote, choice, wanted amplitude) of each number; the amplitude is 1."""
    text = f'title = "Sizes"\n[[item]]\nname = "One"\ncaption = "Size"\n{verdict}\n'
    text += '[[item.case]]\ninput = "case.nml"\nprogram = "run"\n'
    for quote, choice, wanted in numbers:
        text += f'[[item.number]]\ntext = "size {wanted}"\ndataset = "/state/displacement"\nreduce = "max"\n'
        text += f"should_be = {wanted}\ntolerance = 0.1\n"
        text += f'quote = "{quote}"\n' * bool(quote) + f'choice = "{choice}"\n' * bool(choice)
    return text


@pytest.mark.parametrize(
    ("numbers", "verdict"),
    [
        ([("", "", 1.0)], "held by razy"),
        ([("", "", 2.0)], "missed"),
        ([("it is 1", "", 1.0), ("", "", 2.0)], "missed"),
        ([("it is 2", "", 2.0), ("", "", 1.0)], "contradicts"),
        ([("it is 1", "soft", 1.0), ("it is 1", "stiff", 1.0)], "agrees with the source"),
        ([("it is 1", "soft", 1.0), ("it is 1", "stiff", 2.0)], "depends on a choice not printed"),
        ([("it is 1", "soft", 2.0), ("it is 1", "stiff", 2.0)], "contradicts"),
        ([("it is 1", "soft", 1.0), ("it is 1", "stiff", 2.0), ("it is 2", "", 2.0)], "contradicts"),
    ],
)
def test_verdicts_say_what_they_compare(numbers, verdict, folder):
    done = report(written(folder, sized(*numbers)), "--output", "out")
    assert f"1 {verdict}: " in done.stdout, done.stdout + done.stderr
    assert (done.returncode != 0) == (verdict == "missed")
    page = (folder / "out/report.html").read_text()
    if verdict.startswith("depends"):
        assert "“it is 1” (holds with: soft)" in page


def test_what_a_verdict_compares_with_is_told(folder):
    for numbers, words in (
        ([("", "soft", 1.0)], "'size 1.0': a choice needs a quote"),
        ([("it is 1", "", 1.0)], "verdict = 'agrees with the source': known is cannot be decided"),
    ):
        text = sized(*numbers, verdict='verdict = "agrees with the source"' * words.startswith("verdict"))
        done = report(written(folder, text), "--output", "out")
        assert (done.returncode, words in done.stderr) == (2, True), done.stderr


def test_an_input_stands_beside_what_is_printed(folder):
    text = sized().replace("[[item.case]]", 'verdict = "cannot be decided"\n[[item.case]]')
    text += """[[item.table]]
heads = ["printed", "time (s)"]
datasets = ["/time"]
take = [0, 2]
printed = [["first"], ["third"]]
[[item.number]]
text = "stiffness"
dataset = "input:spring%stiffness"
should_be = 100.0
tolerance = 0.0
[[item.number]]
text = "the same, within a factor"
dataset = "input:spring(1)%stiffness"
should_be = 60.0
factor = 2.0
[[item.number]]
text = "time of the largest displacement"
dataset = "/time"
at_largest = "/state/displacement"
should_be = 0.0
tolerance = 1e-9
"""
    done = report(written(folder, text), "--output", "out")
    assert done.returncode == 0, done.stdout + done.stderr
    page = (folder / "out/report.html").read_text()
    assert "<td class=n>third<td class=n>0.02" in page
    assert "60 within a factor of 2<td>yes" in page
    missing = text.replace("spring(1)%", "spring(2)%")
    assert (
        "the input has no"
        in report(written(folder, missing), "--output", "out").stdout + (folder / "out/report.html").read_text()
    )


def test_a_quick_report_leaves_out_what_is_slow(folder):
    case = written(folder, MANIFEST.replace('caption = "Another"', 'caption = "Another"\nslow = true'))
    assert "1 agrees with the source:" in report(case, "--output", "quick", "--quick").stdout
    assert "1 agrees with the source, 1 contradicts" in report(case, "--output", "whole").stdout
    assert "1 contradicts:" in report(case, "--output", "named", "--quick", "--only", "Second").stdout


def test_bad_manifests_are_refused_line_by_line_before_anything_runs(folder):
    bad = MANIFEST.replace('kind = "phase"', 'kind = "campbell"').replace("reduce =", "reduces =", 1)
    bad = bad.replace('input = "case.nml"', 'input = "no.nml"', 1)
    done = report(written(folder, bad), "--output", "out")
    assert done.returncode == 2
    assert "unknown key 'reduces'" in done.stderr
    bad = bad.replace("reduces =", "reduce =")
    lines = report(written(folder, bad), "--output", "out").stderr.splitlines()
    assert [line.rsplit("report.toml: ")[-1] for line in lines] == [
        "item 'First': input = 'no.nml': no such file",
        "item 'First': kind = 'campbell': no such picture of razy-run (has: time, phase, loop)",
    ]
    (folder / "bad.toml").write_text("title = ")
    assert "bad.toml: " in report("bad.toml").stderr
    done = report(written(folder, MANIFEST.replace("initial%displacement=2", "initial%place=2")), "--output", "out")
    assert done.returncode == 2
    assert "item 'First': " in done.stderr
    assert not (folder / "out").exists()


TABLE = '[[item.table]]\ncase = "one"\nheads = ["time"]\ndatasets = ["/time"]\n'
WHERE = 'dataset = "/state/displacement"\n'


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('["initial%displacement=2"]', "[1]", "'First': case 2: set = [1]: has to be a list, each a text"),
        ('["initial%displacement=2"]', '[["a"]]', "set = [['a']]: has to be a list, each a text"),
        ('["initial%displacement=2"]', '["a\\u0000"]', "has to be a list, each a text without control characters"),
        (WHERE, WHERE + 'where = [[1, "<", 2]]\n', "where = [[1, '<', 2]]: has to be a list, each a list of 3"),
        (WHERE, WHERE + "digits = -5\n", "digits = -5: has to be from 0 to 17"),
        (WHERE, WHERE + "digits = true\n", "digits = True: has to be an integer"),
        (WHERE, WHERE + "case = [1, 2]\n", "case = [1, 2]: has to be a text"),
        (WHERE, WHERE + f"scale = 1{400 * '0'}\n", "has to be a finite number"),
        ("[[item.plot]]", TABLE + "order = 99\n[[item.plot]]", "order = 99: from 0, none, to 1"),
        ("[[item.plot]]", TABLE.replace('["time"]', "[1]") + "[[item.plot]]", "heads = [1]: has to be a list"),
        ("[[item.plot]]", "case = [1, 2]\n[[item.plot]]", ""),
        ('title = "Two items"', 'title = "\udcff"', "can't decode byte 0xff"),
        ('title = "Two items"', "title = " + 5000 * "[", "too deep"),
        ('title = "Two items"', "title = 1" + 5000 * "0", "4300 digits"),
        (
            MANIFEST,
            'title = "a"\n[[item]]\nname = "b"\ncaption = "c"\ncase = [1, 2]',
            "'b': case 1: 1: has to be a table",
        ),
    ],
)
def test_a_value_of_another_kind_is_one_line(old, new, words, folder):
    from razy.report.manifest import ManifestError, read_manifest

    (folder / "case.nml").write_text(CASE)
    (folder / "report.toml").write_bytes(MANIFEST.replace(old, new, 1).encode(errors="surrogateescape"))
    with pytest.raises(ManifestError) as error:
        read_manifest(folder)
    assert words in str(error.value), error.value
    assert all("report.toml: " in line and len(line) < 300 for line in str(error.value).splitlines())


def test_an_item_that_fails_says_why_at_once(folder):
    text = sized(("", "", 1.0)).replace("/state", "/nothing").replace('"One"', '"One $x^$"')
    text += (
        '[[item.number]]\ntext = "ratio"\ndataset = "input:mass%value"\nreduce = "ratio_of_intervals"\nat_most = 1\n'
    )
    done = report(written(folder, text), "--output", "out")
    assert done.returncode == 1, done.stderr
    line = next(line for line in done.stdout.splitlines() if line.startswith("One $x^$: failed "))
    assert "no dataset '/nothing/displacement'" in line
    assert "1 of 3 values to take the ratio_of_intervals of" in line


def test_every_input_and_picture_of_the_source_exists():
    from razy.report.manifest import read_manifest

    manifest = read_manifest(SOURCE / "inputs/thesis")
    used = {case.input for item in manifest.item for case in item.case if not case.input.startswith("../")}
    assert used == {path.name for path in (SOURCE / "inputs/thesis").glob("*.nml")}
    assert all(item.verdict or item.expected for item in manifest.item)
    assert all(item.caption_cs for item in manifest.item)
    quoted = {item.name for item in manifest.item if any(number.quote for number in item.number)}
    assert all(item.name in quoted for item in manifest.item if item.expected not in ("", "held by razy"))


def test_pictures_of_the_pages_are_those_of_the_report():
    from razy.report.manifest import read_manifest

    pages = "".join(page.read_text() for page in (SOURCE / "README.md", *(SOURCE / "docs").glob("*.md")))
    saved = {plot.save for item in read_manifest(SOURCE / "inputs/thesis").item for plot in item.plot if plot.save}
    others = {path.name for path in (SOURCE / "docs/images").glob("*.png") if not path.name.startswith("follow_")}
    assert saved == others
    assert all(f"images/{name}" in pages for name in saved)


def test_numbers_at_values_of_the_input_and_where_others_are_largest(folder):
    """Of a dataset (speeds, modes): speeds from the input, the largest of those, and a value that there need not be."""
    (folder / "case.nml").write_text((SOURCE / "inputs/api617/compressor.nml").read_text())
    (folder / "report.toml").write_text("""title = "Speeds"
[[item]]
name = "Speeds"
caption = "Speeds"
[[item.case]]
input = "case.nml"
program = "modes"
[[item.number]]
text = "frequencies"
dataset = "/frequency"
where = [["/speed [rpm]", "<=", "input:response%operating(2)"]]
at_largest = "/speed"
reduce = "count"
should_be = 8
tolerance = 0
[[item.number]]
text = "speed"
dataset = "/speed [rpm]"
where = [["/speed [rpm]", "<=", "input:response%operating(2)"]]
reduce = "max"
should_be = 12500.0
tolerance = 0
[[item.number]]
text = "none"
dataset = "/speed"
where = [["/speed", "<", 0.0]]
optional = true
at_least = 1.0
""")
    done = report(folder)
    assert done.returncode == 0, done.stdout
    text = (folder / "report.toml").read_text()
    (folder / "report.toml").write_text(text.replace("operating(2)", "operating(3)"))
    assert "the input has no 'response%operating(3)'" in report(folder, "--output", "three").stdout
    (folder / "report.toml").write_text(text.replace('dataset = "/speed"', 'dataset = "/sped"'))
    assert "no dataset '/sped'" in report(folder, "--output", "none").stdout


def test_numbers_by_label_and_of_extrema_by_point(folder):
    (folder / "case.nml").write_text((SOURCE / "inputs/thesis/fig_4_7.nml").read_text())
    sweep = 'input = "case.nml"\nprogram = "sweep"\nset = ["sweep%first=1578.5", "sweep%last=1582.5", "sweep%step=1"]\n'
    low = 'where = [["/point/rotation.speed_rpm", "<", 1580.0]]'
    high = 'where = [["/point/rotation.speed_rpm", ">", 1581.0]]'
    doubled = 'where = [["/special/label", "==", "PD"], ["/special/branch", "==", 1.0]]'
    (folder / "report.toml").write_text(f"""title = "Doubling"
[[item]]
name = "Doubling"
caption = "Doubling"
expected = "held by razy"
[[item.case]]
name = "sweep"
{sweep}[[item.case]]
name = "branches"
input = "case.nml"
program = "follow"
set = ["follow%doublings=0"]
[[item.plot]]
save = "doubling.png"
[[item.number]]
text = "doubling"
case = "branches"
dataset = "/special/parameter"
{doubled}
should_be = 1580.463
tolerance = 0.001
[[item.number]]
text = "below"
dataset = "/extrema/mesh_deformation/value"
{low}
reduce = "min"
at_least = -7.6e-6
[[item.number]]
text = "above"
dataset = "/extrema/mesh_deformation/value"
{high}
reduce = "min"
at_most = -7.6e-6
[[item.number]]
text = "where there is no speed"
dataset = "/point/period"
where = [["/point/rotation.speed_rpm", ">", 9000.0]]
""")
    done = report(folder, "--output", "out")
    assert done.returncode == 0, done.stderr + done.stdout
    assert "<td>where there is no speed<td class=n>none<td>" in (folder / "out/report.html").read_text()
    assert (folder / "out/images/doubling.png").read_bytes().startswith(b"\x89PNG")


# Of each page the items of the report that measure its numbers, and numbers that nobody measures: what is put in, what
# the source says, sizes and ranges.
PAGES = {
    "gear_pair": (
        "Figure 4.7|(4.17), (4.18)|Section 4.1, regimes",
        "0 0.05 0.1 1 2 3 4 5 6 8 40 50 100 200 1000 1450 1480 1580 1588 1592 1680 1840 1850 1870 1880 1900 2100 2360 "
        "2500 2800 1543 4.17 4.18 4.625 4.669",
    ),
    "gearbox": (
        "Figure A.4|Section 4.2, regimes|Reductions|Reductions, transfer function",
        "0 0.05 0.3 1e-3 1 2 3 4 5 8 10 12 15 16 20 24 40 42 80 82 50 100 150 200 500 11 178 401 901 1000 2000 3000 "
        "4.15 1080 1100 1870 1990 2500 2660 2860 2900",
    ),
    # Among them processor times of one run, and what is said of orders of magnitude.
    "methods": (
        "Table 4.1, methods",
        "0 0.2 0.5 0.59 0.7 0.9 1 1.0 1.2 1.3 1.6 1.9 2 2.8 3 3.5 4 5 5.5 6.3 6.8 7 7.0 8 9.5 12 15 22 48 51 60 64 66 "
        "100 200 306 400 2013 3000 7700 6000 1484 1e3 1e4 1e5 1e6 1e7 1e8 1e11 1e17 1e-3 1e-4 1e-6 1e-7 1e-8 1e-9 "
        "1e-10 1e-12 1e-13 3e-8 3e-17",
    ),
    "vibropress": (
        "Figure 4.26|Table 4.3|Figure 4.30|Figure 4.30, tuned once",
        "0 1 2 3e-3 9.81 10 20 31 40 41 47 50 60 401 18 0.005 5e7 1e8 30.60 9.795 29.269",
    ),
}


def numerals(text):
    """Return the numbers of a page, but those of code, links, and names such as figure 4.30."""
    text = re.sub(r"```.*?```|`[^`]*`|\]\([^)]*\)", " ", text, flags=re.DOTALL)
    text = re.sub(r"(?i)\b(figures?|tables?|chapter|section) [A\d][\d., A]*((to|and) [\d.]+)?", " ", text)
    text = re.sub(r"^\| [\d.A, ]+\|", " ", re.sub(r"\b[A-Za-z]+\.?\d+\b", " ", text), flags=re.MULTILINE)
    return [n.replace(",", "") for n in re.findall(r"(?<![\w.])\d[\d,]*(?:\.\d+)?(?:e-?\d+)?", text)]


def rounded(value, like):
    """Return whether a value, rounded as a number of a page is, is that number."""
    mantissa, _, power = like.partition("e")
    digits = len(mantissa.partition(".")[2]) - int(power or 0)
    return abs(abs(value) - float(like)) <= 0.5000001 * 10.0**-digits


@pytest.mark.parametrize("page", PAGES)
def test_no_number_stands_on_a_page_that_the_report_does_not_compare(page):
    from razy.report.manifest import read_manifest

    text, (names, given) = (SOURCE / f"docs/{page}.md").read_text(), PAGES[page]
    items = {item.name: item for item in read_manifest(SOURCE / "inputs/thesis").item}
    numbers = [number for name in names.split("|") for number in items[name].number]
    targets = [t for n in numbers for t in (n.should_be, n.at_least, n.at_most) if t is not None]
    # A page says from where on, the report the last speed that is another, or the other way round.
    targets += [t + step for t in targets if page == "gear_pair" and t > 900 for step in (-1.0, 1.0)]
    for link in re.findall(r"\((\.\./bench/report/\w+\.md)\)", text):
        targets += [float(n) for n in numerals((SOURCE / "docs" / link).read_text())]
    known = given.split()
    missing = {n for n in numerals(text) if n not in known and not any(rounded(t, n) for t in targets)}
    assert not missing


@pytest.mark.parametrize(
    ("page", "item"),
    [
        ("gear_pair", "Section 4.1, regimes"),
        ("gearbox", "Section 4.2, regimes"),
        ("gearbox", "Reductions"),
        ("methods", "Table 4.1, methods"),
        ("vibropress", "Figure 4.30, tuned once"),
    ],
)
def test_what_is_measured_for_a_page_stands_there(page, item):
    from razy.report.manifest import read_manifest

    found = numerals((SOURCE / f"docs/{page}.md").read_text())
    (measured,) = (one for one in read_manifest(SOURCE / "inputs/thesis").item if one.name == item)
    for number in measured.number:
        if number.should_be is None:
            continue
        near = [number.should_be + step for step in (-1.0, 0.0, 1.0)] if page == "gear_pair" else [number.should_be]
        assert number.should_be == 0.0 or any(rounded(value, text) for value in near for text in found), number.text
