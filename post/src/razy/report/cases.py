"""The cases of a report, computed by razy's programs; what is there already with the same content is kept."""

import hashlib
import json
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from razy.programs.process import execute
from razy.report.manifest import Case
from razy.target import write_text

# A report computes several cases at a time; each of them alone is to keep to one core.
ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}


@dataclass(frozen=True)
class Done:
    """A case that was computed: its file, or what went wrong, and its processor time in s."""

    file: Path
    problem: str
    seconds: float
    kept: bool = False


class Workshop:
    """Computes cases into a folder.

    Parameters
    ----------
    folder
        Where the results stand, named by the hash of program, input and options.
    programs
        Folder of razy's programs.
    inputs
        Folder that inputs are relative to.
    quick
        Whether the options for a quick report are taken.
    """

    def __init__(self, folder: Path, programs: Path, inputs: Path, quick: bool) -> None:
        self.folder, self.programs, self.inputs, self.quick = folder, programs, inputs, quick
        self._hashes: dict[Path, str] = {}
        self._lock = threading.Lock()

    def options(self, case: Case) -> list[str]:
        """Return the options of a case, those of a quick report last."""
        return [word for value in (*case.set, *(case.quick if self.quick else ())) for word in ("--set", value)]

    def check(self, case: Case) -> str:
        """Return what a program says against an input; empty if nothing."""
        words = [self._program(case), self.inputs / case.input, "--check", *self.options(case)]
        return execute(words).problem

    def key(self, case: Case) -> str:
        """Return the hash of all that a result depends on."""
        content = hashlib.sha256()
        for part in (self._hash(self._program(case)), self._hash(self.inputs / case.input), *self.options(case)):
            content.update(part.encode() + b"\0")
        return content.hexdigest()[:20]

    def compute(self, case: Case) -> Done:
        """Compute a case, unless it is there."""
        key = self.key(case)
        file, notes = self.folder / f"{key}.h5", self.folder / f"{key}.json"
        # What failed is tried again: the disk was full, or it was killed.
        if notes.is_file() and file.is_file():
            return Done(file, "", json.loads(notes.read_text())["seconds"], kept=True)
        words = [self._program(case), self.inputs / case.input, "--output", file, "--force", *self.options(case)]
        ended = execute(words, environment=ONE_THREAD)
        words = [str(word) for word in words]
        write_text(notes, json.dumps({"problem": ended.problem, "seconds": ended.seconds, "case": words}))
        return Done(file, ended.problem, ended.seconds)

    def compute_all(self, cases: Sequence[Case], jobs: int, show: Callable[[Case, Done], None]) -> dict[Case, Done]:
        """Compute cases, `jobs` at a time, those named first begun first; `show` is told of each that is done."""
        self.folder.mkdir(parents=True, exist_ok=True)
        wanted = list({self.key(case): case for case in cases}.values())

        def one(case: Case) -> Done:
            done = self.compute(case)
            with self._lock:
                show(case, done)
            return done

        with ThreadPoolExecutor(jobs) as pool:
            by_key = {self.key(case): done for case, done in zip(wanted, pool.map(one, wanted), strict=True)}
        return {case: by_key[self.key(case)] for case in cases}

    def _program(self, case: Case) -> Path:
        return self.programs / f"razy-{case.program}"

    def _hash(self, path: Path) -> str:
        if path not in self._hashes:
            self._hashes[path] = hashlib.sha256(path.read_bytes()).hexdigest()
        return self._hashes[path]
