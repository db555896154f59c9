"""Memory of a sweep does not grow with the number of its points."""

import subprocess
import time
from pathlib import Path

import pytest
from programs import GEAR_PAIR, SOURCE, command

RECORDS = {f"record({i})%from": 0.01 for i in range(1, 6)}
CASES = {
    # A sweep of many points, each of which makes the machine anew and takes it as it is (planar) or in a chain.
    "planar": (SOURCE / "inputs" / "vibropress.nml", {"sweep%step": 2e-4, "motion%t_end": 0.02, **RECORDS}),
    "lumped": (GEAR_PAIR, {"sweep%step": 2e-3, "motion%t_end": 0.002, "record%from": 0}),
    "chain": (SOURCE / "inputs" / "hysteresis.nml", {"sweep%points": 400001, "motion%t_end": 1, "record%from": 0}),
}


def resident(process):
    """Kilobytes of memory of its own that a process has."""
    lines = Path(f"/proc/{process.pid}/status").read_text().splitlines()
    return int(next(line for line in lines if line.startswith("RssAnon")).split()[1])


def wait_for_size(process, path, size):
    for _ in range(6000):
        assert process.poll() is None, process.stderr.read()
        if path.exists() and path.stat().st_size > size:
            return
        time.sleep(0.01)
    raise AssertionError("the sweep is too slow")


@pytest.mark.parametrize("case", CASES)
def test_memory_does_not_grow_with_the_points(case):
    path, changes = CASES[case]
    words = [*(word for key, value in changes.items() for word in ("--set", f"{key}={value}")), "--output", "case.h5"]
    checkpoint = Path("case.h5.checkpoint")
    with subprocess.Popen(
        command("razy-sweep", path, *words, "--checkpoint", "0.05"),
        stdin=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        wait_for_size(process, checkpoint, 1_000_000)
        # Results of 20 ms, which are written together, have found their room by now.
        before, rows = resident(process), checkpoint.stat().st_size
        wait_for_size(process, checkpoint, 5_000_000)
        grown = resident(process) - before
        rows = checkpoint.stat().st_size - rows
        process.kill()
    # What is written is about 300 bytes a point; what stays in memory is far less than a tenth of it.
    assert 1024 * grown < 0.1 * rows, (grown, rows)
