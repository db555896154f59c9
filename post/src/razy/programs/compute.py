"""Compute a case by one of razy's programs."""

import os
import re
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from razy.arguments import checked
from razy.errors import ResultError
from razy.programs.case import Case, is_file, override, text_of
from razy.programs.process import execute, find_program

INTERRUPTED = 3
PROGRESS = re.compile(r"\d+ of \d+ points, ")
# Results without a file of their own stand here until Python ends.
_scratch: list[tempfile.TemporaryDirectory] = []


@checked
def compute(
    program: str,
    case: Case,
    values: Mapping[str, Any] | None,
    launcher: list[str] | None = None,
    *,
    output: str | Path | None = None,
    force: bool = False,
    progress: bool = True,
    programs: str | Path | None = None,
) -> Path:
    """Return the file of a result; see `razy.run` for the options."""
    words = [*(launcher or []), find_program(program, programs)]
    folder = Path(tempfile.mkdtemp(dir=_folder()))
    given = Path(case) if is_file(case) else folder / "case.nml"
    if not is_file(case):
        given.write_text(text_of(case), encoding="utf-8")
    result = folder / f"{given.stem}.h5" if output is None else Path(output)
    words += [given, "--output", result, *(["--force"] if force else [])]
    words += [word for key, value in (values or {}).items() for word in ("--set", override(key, value))]

    def hear(line: str) -> bool:
        if PROGRESS.match(line):
            if progress:
                print(line.rstrip(), file=sys.stderr, flush=True)
            return False
        return bool(line.strip()) and not line.startswith("wrote ")

    ended = execute(words, hear)
    # Below such a line mpirun says at length that the program has ended.
    last = next((number for number, line in enumerate(ended.said) if line.startswith("-----")), len(ended.said))
    said = [line.replace(f"{folder}{os.sep}", "") for line in ended.said[:last]]
    if ended.code != 0:
        problem = said[-1].strip() if said else f"{program}: exit code {ended.code}"
        goes_on = ended.code == INTERRUPTED and output is not None
        raise ResultError(problem + (" (the same call goes on)" if goes_on else ""))
    if progress and said:
        print("\n".join(said), file=sys.stderr)
    return result


def _folder() -> str:
    """Return the folder of results that nobody gave a name; it goes when Python ends."""
    if not _scratch:
        _scratch.append(tempfile.TemporaryDirectory(prefix="razy-"))
    return _scratch[0].name
