"""Every input of inputs/, shortened, goes through each program that takes it without a finding of the sanitizers.

Only in a build with them (the preset `sanitize`). MPI, HDF5 and gfortran's array constructors lose some memory once;
what must not be is that more is lost with more points.
"""

import re
from pathlib import Path

import f90nml
import pytest
from programs import SOURCE, start

INPUTS = sorted((SOURCE / "inputs").rglob("*.nml"))
FOUND = 99
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


@pytest.fixture
def watched(monkeypatch):
    """What sanitizers find ends the program with a code of its own."""
    monkeypatch.setenv("ASAN_OPTIONS", f"exitcode={FOUND}:detect_leaks=0")
    monkeypatch.setenv("UBSAN_OPTIONS", f"exitcode={FOUND}:print_stacktrace=1")


@pytest.mark.parametrize("path", INPUTS, ids=lambda path: str(path.relative_to(SOURCE / "inputs")))
def test_sanitizers_find_nothing(watched, path):
    for program in programs(path):
        done = start(program, path, *options(path), "--force", timeout=PATIENCE)
        assert done.returncode in (0, 1, 2), done.stderr[-4000:]
        assert "Sanitizer" not in done.stderr and "runtime error" not in done.stderr, done.stderr[-4000:]


@pytest.mark.parametrize("ranks", [2, 3])
def test_sanitizers_find_nothing_on_several_ranks(watched, ranks):
    for name in ("torsional_gear_pair", "hysteresis"):
        path = SOURCE / "inputs" / f"{name}.nml"
        done = start("razy-sweep", path, *options(path), "--force", ranks=ranks, timeout=PATIENCE)
        assert done.returncode == 0, done.stderr[-4000:]


def test_sanitizers_find_nothing_in_what_is_refused(watched):
    for word in ("--set=motion%t_end=x", "--set=motion%nothing=1", "--set=scene%kind='rotor'", "--nothing"):
        done = start("razy-run", SOURCE / "inputs" / "torsional_gear_pair.nml", word, timeout=PATIENCE)
        assert done.returncode == 2, done.stderr[-4000:]


SWEPT = {
    "torsional_gear_pair": ("rotation%speed_rpm', first=1000.0, last=1600.0", "observable='mesh_deformation'"),
    "rotor_rub": ("rotation%speed_rpm', first=5900.0, last=6100.0", "observable='contact_force', of='rub'"),
    "vibropress_vertical": (
        "load%frequency', first=49.0, last=51.0",
        "observable='contact_force', of='table-pallet'",
    ),
}


def lost(name, integrator, points):
    """Bytes that a sweep of so many points loses."""
    text = (SOURCE / "inputs" / f"{name}.nml").read_text()
    end = float(re.search(r"t_end=([0-9.]+)", text)[1]) / SHORTER
    varied, recorded = SWEPT[name]
    text = re.sub(r"(?ms)^&(sweep|follow|tune|record)\b.*?/$", "", text)
    text += f"&record {recorded}, what='extrema' /\n&sweep parameter='{varied}, points={points} /\n"
    Path("case.nml").write_text(text)
    settings = (f"motion%t_end={end}", f"motion%step={end / 1000}", f"motion%integrator='{integrator}'")
    words = [word for setting in settings for word in ("--set", setting)]
    done = start("razy-sweep", "case.nml", *words, "--force", timeout=PATIENCE)
    assert f"{points} points, 0 failed" in done.stderr, done.stderr[-4000:]
    found = re.search(r"SUMMARY: AddressSanitizer: (\d+) byte", done.stderr)
    return int(found[1]) if found else 0


@pytest.mark.parametrize("name", SWEPT)
@pytest.mark.parametrize("integrator", ["exact", "dop853", "radau5", "moreau_jean"])
def test_more_points_lose_no_more_memory(name, integrator):
    assert lost(name, integrator, 22) == lost(name, integrator, 11)
