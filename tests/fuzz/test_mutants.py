"""Damaged inputs: each program ends in time, with a documented exit code and a message of one short line."""

import os
import subprocess
from pathlib import Path

import mutants
import numpy as np
import pytest

BIN = Path(os.environ["RAZY_BUILD"]) / "bin"
FIRST, LAST = (int(number) for number in os.environ.get("RAZY_FUZZ_SEEDS", "0:20").split(":"))
EACH = 5
PATIENCE = 60
LONGEST = 500


def attack(seed):
    """What is wrong with the end of a program, or nothing; the input is left as `mutant.nml`."""
    random = np.random.default_rng([17, seed])
    text, programs = mutants.mutant(random)
    Path("mutant.nml").write_text(text)
    program = mutants.one_of(random, programs)
    words = ["--set", "motion%max_seconds=1", "--force"]
    if program == "razy-sweep":
        for i in range(1, 1 + max(1, text.count("&sweep "))):
            words += ["--set", f"sweep({i})%points=3", "--set", f"sweep({i})%step=0"]
    if program == "razy-follow":
        words += ["--set", "follow%max_points=60"]
    command = [BIN / program, "mutant.nml", *words]
    try:
        done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        return f"{program}: more than {PATIENCE} s"
    said = done.stderr.decode(errors="replace").splitlines()
    if done.returncode not in (0, 1, 2):
        return f"{program}: exit {done.returncode}: {said[-5:]}"
    if done.returncode == 2 and len(said) != 1:
        return f"{program}: {len(said)} lines: {said[:5]}"
    if done.returncode > 0 and not said:
        return f"{program}: exit {done.returncode} without a word"
    if any("rror termination" in line or "Fortran runtime" in line for line in said):
        return f"{program}: {said[-5:]}"
    if max(map(len, said), default=0) > LONGEST:
        return f"{program}: a message of {max(map(len, said))} characters"
    return ""


@pytest.mark.parametrize("seed", range(FIRST, LAST))
def test_damaged_inputs_are_refused_or_run(seed, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for number in range(EACH * seed, EACH * (seed + 1)):
        assert attack(number) == "", (number, Path("mutant.nml").read_text()[:4000])
