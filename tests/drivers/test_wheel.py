"""One wheel of programs and Python package, built by pip, in an environment of its own."""

import subprocess
import sys
import zipfile

from programs import PATIENCE, SOURCE

CASE = SOURCE / "inputs" / "two_sided_stop.nml"
PROGRAMS = {f"razy-{name}" for name in ("duel", "follow", "modes", "run", "sweep", "tune")}
SLOW = 3600
"""Seconds within which a busy computer compiles razy."""


def run(*words, patience=PATIENCE):
    # Nothing but the system's programs and what the environment has.
    words, alone = list(map(str, words)), {"PATH": "/usr/bin:/bin", "HOME": "/tmp"}
    done = subprocess.run(words, capture_output=True, text=True, timeout=patience, env=alone)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    return done.stdout


def test_wheel_in_a_fresh_environment(folder):
    run(sys.executable, "-m", "venv", folder / "made")
    run(folder / "made/bin/pip", "wheel", "-q", "--no-deps", "-w", folder, SOURCE, patience=SLOW)
    (wheel,) = folder.glob("razy-*.whl")
    assert "-py3-none-linux_" in wheel.name
    with zipfile.ZipFile(wheel) as content:
        names = [name.split("/") for name in content.namelist()]
    assert {name[-1] for name in names if name[-2] == "scripts"} == PROGRAMS
    assert not any("tests" in name for name in names)
    programs = folder / "made/bin"
    run(programs / "pip", "install", "-q", wheel, patience=SLOW)
    assert run(programs / "razy-run", "--version").startswith("razy-run")
    run(programs / "razy-run", CASE, "--output", folder / "run.h5")
    run(programs / "razy-plot", folder / "run.h5", "--save", folder / "run.png")
    said = run(programs / "python", "-c", f"import razy; print(razy.run({str(CASE)!r}).program, razy.__file__)")
    assert said.split()[0] == "razy-run" and said.split()[1].startswith(str(folder / "made"))
