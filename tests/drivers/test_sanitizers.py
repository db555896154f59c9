"""Every input of inputs/, shortened, goes through each program that takes it without a finding of the sanitizers.

Only in a build with them (the preset `sanitize`). No memory that the programs' own procedures ask for is lost; what MPI
loses does not count, and some of that comes from parts that it has unloaded, without names.
"""

import re
from pathlib import Path

import f90nml
import pytest
from programs import SOURCE, start

INPUTS = sorted((SOURCE / "inputs").rglob("*.nml"))
FOUND = 99
KNOWN = Path(__file__).parent / "leaks.supp"
# A line of a stack in the sources, but for the allocation itself.
OWN = re.compile(rf" in .*{SOURCE}/(src|drivers)/(?!memory)")
LEAKS = "ERROR: LeakSanitizer: .*|SUMMARY: AddressSanitizer: .* leaked .*"
SHORTER = 50
PATIENCE = 300


def groups(case, name):
    found = case.get(name, [])
    return found if isinstance(found, list) else [found]


def options(path):
    """Options that leave of a motion its beginning, of an axis its ends, and of branches their first motions."""
    case = f90nml.read(path)
    values = {"motion%t_end": case["motion"]["t_end"] / SHORTER} if "t_end" in case.get("motion", {}) else {}
    values["motion%max_seconds"] = 20
    for i in range(1, 1 + len(groups(case, "record"))):
        values[f"record({i})%from"] = 0
    for i, axis in enumerate(groups(case, "sweep"), 1):
        values |= {f"sweep({i})%step": axis["last"] - axis["first"]} if "step" in axis else {f"sweep({i})%points": 2}
    for i, axis in enumerate(groups(case, "follow")[:1], 1):
        values[f"follow({i})%last"] = axis["first"] + (axis["last"] - axis["first"]) / SHORTER
    return [word for key, value in values.items() for word in ("--set", f"{key}={value}")]


def programs(path):
    case = f90nml.read(path)
    return ["razy-run", "razy-modes", *(f"razy-{name}" for name in ("sweep", "follow", "tune", "duel") if name in case)]


@pytest.fixture(autouse=True)
def watched(monkeypatch):
    """What sanitizers find ends the program with a code of its own, but for leaks."""
    monkeypatch.setenv("ASAN_OPTIONS", f"exitcode={FOUND}:detect_leaks=1")
    monkeypatch.setenv("LSAN_OPTIONS", f"exitcode=0:suppressions={KNOWN}:print_suppressions=0")
    monkeypatch.setenv("UBSAN_OPTIONS", f"exitcode={FOUND}:print_stacktrace=1")


def expect_clean(said, name):
    """No finding, and no leak of memory for which a procedure of the programs had asked, whoever allocated it."""
    lost = [part for part in re.split(r"\n\n+", said) if re.match(r"(Direct|Indirect) leak", part) and OWN.search(part)]
    assert not lost, f"{name}: {len(lost)} leaks, first {lost[0][:2000]}"
    assert "Sanitizer: " not in re.sub(LEAKS, "", said) and "runtime error" not in said, f"{name}: {said[-4000:]}"


@pytest.mark.parametrize("path", INPUTS, ids=lambda path: str(path.relative_to(SOURCE / "inputs")))
def test_sanitizers_find_nothing(path):
    for program in programs(path):
        done = start(program, path, *options(path), "--force", timeout=PATIENCE)
        assert done.returncode in (0, 1, 2), done.stderr[-4000:]
        expect_clean(done.stderr, program)


@pytest.mark.parametrize("ranks", [2, 3])
def test_sanitizers_find_nothing_on_several_ranks(ranks):
    for name in ("torsional_gear_pair", "hysteresis"):
        path = SOURCE / "inputs" / f"{name}.nml"
        done = start("razy-sweep", path, *options(path), "--force", ranks=ranks, timeout=PATIENCE)
        assert done.returncode == 0, done.stderr[-4000:]
        expect_clean(done.stderr, f"{name} on {ranks} ranks")


def test_sanitizers_find_nothing_in_what_is_refused():
    for word in ("--set=motion%t_end=x", "--set=motion%nothing=1", "--set=scene%kind='rotor'", "--nothing"):
        done = start("razy-run", SOURCE / "inputs" / "torsional_gear_pair.nml", word, timeout=PATIENCE)
        assert done.returncode == 2, done.stderr[-4000:]
        expect_clean(done.stderr, word)


SWEPT = {
    "torsional_gear_pair": ("rotation%speed_rpm', first=1000.0, last=1600.0", "observable='mesh_deformation'"),
    "rotor_rub": ("rotation%speed_rpm', first=5900.0, last=6100.0", "observable='contact_force', of='rub'"),
    "vibropress_vertical": (
        "load%frequency', first=49.0, last=51.0",
        "observable='contact_force', of='table-pallet'",
    ),
}


@pytest.mark.parametrize("name", SWEPT)
@pytest.mark.parametrize("integrator", ["exact", "dop853", "radau5", "moreau_jean"])
def test_sanitizers_find_nothing_by_any_method(name, integrator):
    text = (SOURCE / "inputs" / f"{name}.nml").read_text()
    end = float(re.search(r"t_end=([0-9.]+)", text)[1]) / SHORTER
    varied, recorded = SWEPT[name]
    text = re.sub(r"(?ms)^&(sweep|follow|tune|record)\b.*?/$", "", text)
    text += f"&record {recorded}, what='extrema' /\n&sweep parameter='{varied}, points=11 /\n"
    Path("case.nml").write_text(text)
    settings = (f"motion%t_end={end}", f"motion%step={end / 1000}", f"motion%integrator='{integrator}'")
    words = [word for setting in settings for word in ("--set", setting)]
    done = start("razy-sweep", "case.nml", *words, "--force", timeout=PATIENCE)
    assert "11 points, 0 failed" in done.stderr, done.stderr[-4000:]
    expect_clean(done.stderr, f"{name} by {integrator}")
