"""Find and run programs; nothing else in this package starts a process."""

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from razy.errors import ResultError


@dataclass(frozen=True)
class Ended:
    """How a program ended: its exit code, the lines on its error channel, its processor time in s."""

    code: int
    said: list[str]
    seconds: float

    @property
    def problem(self) -> str:
        """What went wrong, in one line; empty if nothing."""
        if self.code == 0:
            return ""
        return next((line.strip() for line in reversed(self.said) if line.strip()), f"exit code {self.code}")


def find_program(name: str, folder: str | Path | None = None) -> Path:
    """Return the path of a program of razy; see `razy.run` for where it is looked for."""
    chosen = folder or os.environ.get("RAZY_BIN")
    if chosen:
        if not (Path(chosen) / name).is_file():
            raise ResultError(f"{chosen}: there is no program {name} in this folder")
        # A name without a folder would be looked for on PATH.
        return (Path(chosen) / name).absolute()
    # The package lies in post/src of a clone, or in share/razy/python below the prefix of an installation.
    above = Path(__file__).resolve().parents
    beside = (Path(sys.executable).parent, above[4] / "build" / "bin", above[5] / "bin")
    found = shutil.which(name) or shutil.which(name, path=os.pathsep.join(map(str, beside)))
    if found is None:
        raise ResultError(f"there is no program {name} on PATH; name its folder by programs= or RAZY_BIN")
    return Path(found)


def execute(
    words: Sequence[str | Path],
    hear: Callable[[str], bool] = lambda _: True,
    environment: Mapping[str, str] | None = None,
) -> Ended:
    """Run a program to its end.

    Parameters
    ----------
    words
        The program and its arguments.
    hear
        Is told of each line on the error channel as it comes; the lines for which it is true are kept.
    environment
        Variables beside those that there are.

    Raises
    ------
    ResultError
        The program cannot be started.
    """
    try:
        process = subprocess.Popen(
            [str(word) for word in words],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
            env=os.environ | dict(environment or {}),
        )
    except (OSError, ValueError) as error:
        raise ResultError(f"{words[0]}: cannot be run: {error}") from None
    with process:
        try:
            said = [line.rstrip() for line in process.stderr or () if hear(line)]
            _, status, usage = os.wait4(process.pid, 0)
        except BaseException:
            process.terminate()
            raise
        process.returncode = os.waitstatus_to_exitcode(status)
    return Ended(process.returncode, said, usage.ru_utime + usage.ru_stime)


def listen(words: Sequence[str | Path], patience: float) -> list[str]:
    """Return the lines that a program prints, of whatever channel has some; one that says why if it cannot be run."""
    try:
        done = subprocess.run(words, capture_output=True, text=True, timeout=patience, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        return [f"{words[0]}: {'not found' if isinstance(error, FileNotFoundError) else error}"]
    return (done.stdout or done.stderr).splitlines()
