"""Cases: a file, the text of a namelist, or groups and keys in a dict."""

import reprlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import f90nml
import numpy as np

from razy.arguments import check, checked
from razy.errors import ResultError
from razy.target import write_text

Case = str | Path | Mapping[str, Any]


@checked
def write_case(case: Case, file: str | Path, force: bool = False) -> Path:
    """Write a case as a namelist file.

    Parameters
    ----------
    case
        Path of a file, the text of a namelist (it has a ``&``), or a dict: groups with their keys, of a group that
        is there several times a list of dicts, such as
        ``{"scene": {"kind": "lumped"}, "mass": [{"name": "a", "value": 1.0}, {"name": "b", "value": 2.0}]}``.
    file
        File to write.
    force
        Whether to overwrite it.
    """
    file = Path(file)
    if file.exists() and not file.is_file():
        raise ResultError(f"{file}: is a folder or a device, not a file that can be replaced")
    if file.exists() and not force:
        raise ResultError(f"{file}: exists already (force=True overwrites it)")
    text = text_of(case)
    if not file.parent.is_dir():
        raise ResultError(f"{file}: no folder '{file.parent}'")
    write_text(file, text)
    return file


def is_file(case: Case) -> bool:
    """Return whether a case is the path of a file."""
    return isinstance(case, Path) or (isinstance(case, str) and "&" not in case)


def text_of(case: Case) -> str:
    """Return the text of a case."""
    if is_file(case):
        if not Path(case).is_file():
            raise ResultError(f"{case}: no such file")
        try:
            return Path(case).read_text(encoding="utf-8")
        except UnicodeDecodeError:
            raise ResultError(f"{case}: not a text file") from None
    if isinstance(case, str):
        return case
    if not isinstance(case, Mapping):
        raise ResultError(f"a case is a path, the text of a namelist or a dict, not {type(case).__name__}")
    lines = []
    for name, members in case.items():
        for group in members if isinstance(members, list | tuple) else [members]:
            if not isinstance(group, Mapping):
                raise ResultError(f"group '{name}': a dict of its keys or a list of such, not {type(group).__name__}")
            check({f"group '{name}'": group}, {f"group '{name}'": Mapping[str, Any]})
            lines.append(str(f90nml.Namelist({name: {key: plain(value) for key, value in group.items()}})))
    return "\n".join(lines) + "\n"


def override(key: str, value: Any) -> str:
    """Return a change of a case as the option --set takes it: ``load%value=-50.0``."""
    value = plain(value)
    words = [_word(item) for item in (value if isinstance(value, list) else [value])]
    return f"{key}={','.join(words)}"


def plain(value: Any) -> Any:
    """Return a value without numpy's types; arrays and tuples as lists."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, Path):
        return str(value)
    if not isinstance(value, bool | int | float | str):
        raise ResultError(f"{reprlib.repr(value)}: a value is a number, a text, true or false, or a list of such")
    return value


def _word(value: bool | float | str) -> str:
    if isinstance(value, bool):
        return f".{value}.".lower()
    return "'" + value.replace("'", "''") + "'" if isinstance(value, str) else repr(value)
