"""Interrupt a sweep in the ways a cluster does, and start it again."""

import contextlib
import os
import signal
import subprocess
import time
from pathlib import Path

from programs import PATIENCE, command, datasets, start

CHECKPOINT = "case.h5.checkpoint"


class Sweep:
    """A sweep that is interrupted, whose results are compared with those of an undisturbed one."""

    def __init__(self, *arguments):
        self.arguments = [*arguments, "--output", "case.h5"]
        done = start("razy-sweep", *arguments, "--output", "whole.h5", timeout=900)
        assert done.returncode == 0, done.stderr

    def start(self, *more, ranks=None, **options):
        """Run to the end."""
        return start("razy-sweep", *self.arguments, *more, ranks=ranks, **options)

    def begin(self, ranks=None, options=()):
        """Start in a session of its own, all output in one file."""
        words = command("razy-sweep", *self.arguments, *options, ranks=ranks)
        with Path("log").open("w") as log:
            return subprocess.Popen(
                words, stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT, start_new_session=True
            )

    def expect_whole(self):
        """The file is that of the undisturbed sweep, byte for byte, and nothing else is left."""
        assert datasets("case.h5") == datasets("whole.h5")
        assert Path("case.h5").read_bytes() == Path("whole.h5").read_bytes()
        assert not Path(CHECKPOINT).exists()


def processes_of(session, name="razy-sweep"):
    """Processes of a session that run a program (any for an empty name); mpirun gives each rank a group of its own."""
    found = []
    for entry in Path("/proc").iterdir():
        if not entry.name.isdecimal():
            continue
        with contextlib.suppress(OSError):
            fields = (entry / "stat").read_text().rsplit(")", 1)[1].split()
            running = fields[0] != "Z" and name in ("", (entry / "comm").read_text().strip())
            if int(fields[3]) == session and running:
                found.append(int(entry.name))
    return sorted(found)


def rank_of(process):
    """Rank of a process in its mpirun."""
    words = Path(f"/proc/{process}/environ").read_bytes().split(b"\0")
    return int(dict(word.split(b"=", 1) for word in words if b"=" in word).get(b"OMPI_COMM_WORLD_RANK", b"0"))


def wait_until_recorded(process, more_than=0):
    """Wait until the checkpoint has grown; false if the sweep has ended before."""
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        with contextlib.suppress(FileNotFoundError):
            if Path(CHECKPOINT).stat().st_size > more_than:
                return process.poll() is None
        if process.poll() is not None:
            return False
        time.sleep(0.005)
    raise AssertionError("nothing was recorded")


def kill_all(process):
    """Kill mpirun and all ranks, and wait until none is left that holds the checkpoint."""
    for number in processes_of(process.pid, name=""):
        with contextlib.suppress(ProcessLookupError):
            os.kill(number, signal.SIGKILL)
    process.wait(timeout=PATIENCE)
    deadline = time.monotonic() + PATIENCE
    while processes_of(process.pid):
        assert time.monotonic() < deadline, "a killed sweep does not end"
        time.sleep(0.01)


def points_done(text):
    """How many points a sweep says that it goes on from, or stopped at."""
    lines = [line for line in text.splitlines() if "points are done" in line]
    assert len(lines) == 1, text
    return int(lines[0].split(": ")[1].split()[0])
