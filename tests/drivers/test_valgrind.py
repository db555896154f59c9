"""A motion of each kind of scene, and each program, reads no memory that nobody has written."""

import shutil
import subprocess
from pathlib import Path

import pytest
from programs import SOURCE, command, sets

VALGRIND = shutil.which("valgrind")
FOUND = 99
# What Open MPI knows of itself.
KNOWN = Path("/usr/share/openmpi/openmpi-valgrind.supp")
# program, input, what is shortened
RUNS = {
    "lumped": ("razy-run", "torsional_gear_pair", {"motion__t_end": 0.01, "record__from": 0}),
    "planar": ("razy-run", "planar_incline", {"motion__t_end": 0.05}),
    "rotor": ("razy-run", "rotor_rub", {"motion__t_end": 0.005}),
    "friction": ("razy-run", "block_on_belt", {"motion__t_end": 1.0}),
    "modes": ("razy-modes", "test_gearbox", {}),
    "tune": ("razy-tune", "vibropress_vertical", {}),
    "sweep": ("razy-sweep", "hysteresis", {"sweep__points": 2, "motion__t_end": 1.0, "record__from": 0}),
    "follow": ("razy-follow", "impact_oscillator", {"follow__last": 2.21}),
}


@pytest.mark.skipif(VALGRIND is None, reason="no valgrind (Debian: apt-get install valgrind)")
@pytest.mark.parametrize("kind", RUNS)
def test_valgrind_finds_nothing(kind, folder):
    program, name, shorter = RUNS[kind]
    watch = [VALGRIND, f"--error-exitcode={FOUND}", "--log-file=valgrind.log"]
    watch += [f"--suppressions={KNOWN}"] if KNOWN.exists() else []
    words = command(program, SOURCE / "inputs" / f"{name}.nml", *sets(**shorter))
    done = subprocess.run([*watch, *words], stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=900)
    log = (folder / "valgrind.log").read_text()
    assert done.returncode == 0, done.stderr[-1000:] + log[-4000:]
