"""What the effective input of a result file says of the machine: its groups as dictionaries."""

from typing import Any

import f90nml

from razy.errors import ResultError
from razy.read.file import ResultFile

Group = dict[str, Any]


def read_description(result: ResultFile) -> dict[str, list[Group]]:
    """Return the groups of the effective input by their names, each a list, as groups may be repeated.

    Keys are in lower case; an input that is no namelist is a `ResultError`.
    """
    try:
        found = f90nml.reads(result.input)
        groups = {name: found[name] for name in map(str, found)}
        return {name: [dict(one) for one in (g if isinstance(g, list) else [g])] for name, g in groups.items()}
    except Exception as cause:
        raise ResultError(f"{result.path}: attribute 'input' is not a namelist") from cause


def values_of(group: Group, key: str) -> list[Any]:
    """Return the values of a key as a list; empty where it is not given."""
    value = group.get(key)
    if value is None:
        return []
    return value if isinstance(value, list) else [value]
