"""razy-report on small manifests, and the manifest of the source."""

import json

from programs import BUILD, SOURCE, plot

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
expected = "agrees"
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
"""


def report(*arguments):
    return plot(*arguments, "--programs", BUILD / "bin", module="razy_post.report.cli")


def written(folder, manifest=MANIFEST):
    (folder / "case.nml").write_text(CASE)
    (folder / "report.toml").write_text(manifest)
    return folder


def test_page_and_pdf_say_what_agrees(folder):
    done = report(written(folder), "--output", "out")
    assert done.returncode == 0, done.stderr
    page = (folder / "out/report.html").read_text()
    assert page.count("data:image/png;base64,") == 1
    assert "1 agrees, 1 contradicts" in page
    assert "A vibration &amp; its size" in page
    assert "src='http" not in page
    pdf = (folder / "out/report.pdf").read_bytes()
    assert pdf.startswith(b"%PDF")
    assert b"/Type0" in pdf and b"/Type3" not in pdf
    assert len(list((folder / "out/cases").glob("*.h5"))) == 2


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


def test_a_verdict_that_turns_fails(folder):
    manifest = MANIFEST.replace("should_be = 1.0", "should_be = 3.0")
    done = report(written(folder, manifest), "--output", "out")
    assert done.returncode == 1
    assert "First: contradicts, expected agrees" in done.stderr


def test_a_quick_report_leaves_out_what_is_slow(folder):
    case = written(folder, MANIFEST.replace('caption = "Another"', 'caption = "Another"\nslow = true'))
    assert "1 agrees:" in report(case, "--output", "quick", "--quick").stdout
    assert "1 agrees, 1 contradicts" in report(case, "--output", "whole").stdout
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
        "item First: input = 'no.nml': no such file",
        "item First: kind = 'campbell': no such picture of razy-run (has: time, phase, loop)",
    ]
    (folder / "bad.toml").write_text("title = ")
    assert "bad.toml: " in report("bad.toml").stderr
    done = report(written(folder, MANIFEST.replace("initial%displacement=2", "initial%place=2")), "--output", "out")
    assert done.returncode == 2
    assert "item First: " in done.stderr
    assert not (folder / "out").exists()


def test_every_input_and_picture_of_the_source_exists():
    from razy_post.report.manifest import read_manifest

    manifest = read_manifest(SOURCE / "inputs/thesis")
    used = {case.input for item in manifest.item for case in item.case if not case.input.startswith("../")}
    assert used == {path.name for path in (SOURCE / "inputs/thesis").glob("*.nml")}
    assert all(item.verdict or item.expected for item in manifest.item)
    assert all(item.caption_cs for item in manifest.item)


def test_pictures_of_the_pages_are_those_of_the_report():
    from razy_post.report.manifest import read_manifest

    pages = "".join(page.read_text() for page in (SOURCE / "README.md", *(SOURCE / "docs").glob("*.md")))
    saved = {plot.save for item in read_manifest(SOURCE / "inputs/thesis").item for plot in item.plot if plot.save}
    others = {path.name for path in (SOURCE / "docs/images").glob("*.png") if not path.name.startswith("follow_")}
    assert saved == others
    assert all(f"images/{name}" in pages for name in saved)


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
expected = "agrees"
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


def test_numbers_of_the_gear_pairs_page_are_those_that_the_report_compares():
    from razy_post.report.manifest import read_manifest

    page = (SOURCE / "docs/gear_pair.md").read_text()
    items = {item.name: item for item in read_manifest(SOURCE / "inputs/thesis").item}
    doublings = [number for number in items["Figure 4.7, (4.17), (4.18)"].number if number.case == "branches"]
    assert all(f"{number.should_be:.3f}" in page for number in doublings)
    for number in items["Section 4.1, regimes"].number:
        # The page says from where on, the report the last speed that is another, or the other way round.
        near = {f"{number.should_be + step:.{number.digits}f}" for step in (-1.0, 0.0, 1.0)}
        assert any(text in page for text in near), number.text
