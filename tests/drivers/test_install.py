"""The installed package: programs, and a library that another CMake project finds."""

import os
import subprocess
from pathlib import Path

from programs import BUILD, GEAR_PAIR, PATIENCE


def run(*words):
    done = subprocess.run(
        list(map(str, words)), stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=PATIENCE
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_install_and_use(folder):
    cmake = os.environ["RAZY_CMAKE"]
    prefix, consumer = folder / "prefix", folder / "consumer"
    run(cmake, "--install", BUILD, "--prefix", prefix)
    for program in ("razy-run", "razy-sweep"):
        assert run(prefix / "bin" / program, "--version").startswith(program)
    assert not [path for path in prefix.rglob("*") if path.suffix == ".mod" and not path.name.startswith("razy_")]
    run(
        cmake, "-S", Path(__file__).parent / "consumer", "-B", consumer, f"-DCMAKE_PREFIX_PATH={prefix}",
        f"-DCMAKE_Fortran_COMPILER={os.environ['RAZY_FORTRAN']}",
    )  # fmt: skip
    run(cmake, "--build", consumer)
    assert run(consumer / "consumer", GEAR_PAIR) == "coordinates: 4\n"
