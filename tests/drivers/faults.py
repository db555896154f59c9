"""Interrupt a sweep in the ways a cluster does, and start it again."""

import contextlib
import os
import signal
import subprocess
import time
from pathlib import Path

from programs import PATIENCE, command, datasets, start

CHECKPOINT = "case.h5.checkpoint"
PAUSE = os.environ["RAZY_PAUSE"]


class Sweep:
    """A sweep that is interrupted, whose results are compared with those of an undisturbed one."""

    def __init__(self, *arguments):
        self.arguments = [*arguments, "--output", "case.h5"]
        done = start("razy-sweep", *arguments, "--output", "whole.h5", timeout=900)
        assert done.returncode == 0, done.stderr

    def start(self, *more, ranks=None, **options):
        """Run to the end."""
        return start("razy-sweep", *self.arguments, *more, ranks=ranks, **options)

    def begin(self, recorded=None, ranks=None, options=()):
        """Start in a session of its own, all output in `log`; the writer pauses at so many bytes of its checkpoint."""
        words = command("razy-sweep", *self.arguments, *options, ranks=ranks)
        pause = {} if recorded is None else {"LD_PRELOAD": PAUSE, "RAZY_TEST_PAUSE": str(recorded)}
        with Path("log").open("w") as log:
            process = subprocess.Popen(
                words,
                stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT,
                start_new_session=True, env=os.environ | pause,
            )  # fmt: skip
        if recorded is not None:
            wait_for(lambda: paused(process) or process.poll() is not None, "nothing was recorded")
            assert process.poll() is None, Path("log").read_text()
        return process

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


def wait_for(condition, otherwise):
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline, otherwise
        time.sleep(0.005)


def paused(process):
    """The rank that has paused itself, in a list."""
    found = []
    for number in processes_of(process.pid):
        with contextlib.suppress(OSError):
            if (Path(f"/proc/{number}/stat").read_text().rsplit(")", 1)[1].split())[0] == "T":
                found.append(number)
    return found


def has_pending(process, number):
    """Whether a signal waits for the process, which has stopped, to go on."""
    line = next(line for line in Path(f"/proc/{process}/status").read_text().splitlines() if line.startswith("ShdPnd"))
    return bool(int(line.split()[1], 16) >> (number - 1) & 1)


def resume(process):
    """Let the rank that has paused go on."""
    for number in paused(process):
        os.kill(number, signal.SIGCONT)


def stop(process, number, rank=None):
    """Send a signal to all ranks, or to one; once it waits for the writer that one goes on. Return the exit code."""
    targets = [target for target in processes_of(process.pid) if rank in (None, rank_of(target))]
    assert targets
    os.kill(process.pid if rank is None else targets[0], number)
    waiting = [target for target in paused(process) if target in targets]
    wait_for(lambda: all(has_pending(target, number) for target in waiting), "the signal does not come")
    resume(process)
    return process.wait(timeout=PATIENCE)


def kill_all(process):
    """Kill mpirun and all ranks, and wait until none is left that holds the checkpoint."""
    for number in processes_of(process.pid, name=""):
        with contextlib.suppress(ProcessLookupError):
            os.kill(number, signal.SIGKILL)
    process.wait(timeout=PATIENCE)
    wait_for(lambda: not processes_of(process.pid), "a killed sweep does not end")


def points_done(text):
    """How many points a sweep says that it goes on from, or stopped at."""
    lines = [line for line in text.splitlines() if "points are done" in line]
    assert len(lines) == 1, text
    return int(lines[0].split(": ")[1].split()[0])
