"""Numbers and tables out of result files, and the verdict that follows."""

import operator
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import f90nml
import h5py
import numpy as np
from numpy.typing import NDArray

from razy.errors import ResultError
from razy.read.file import check_storage, making_sense_of, open_hdf5, text
from razy.report.cases import Done
from razy.report.manifest import (
    AGREES,
    CONTRADICTS,
    DEPENDS,
    FAILED,
    HELD,
    MISSED,
    Item,
    Number,
    Table,
)

COMPARE = {
    "==": operator.eq, "!=": operator.ne, "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge,
}  # fmt: skip
INPUT = "input:"
CHECK = "check:"
RPM = " [rpm]"


class NothingThereError(ResultError):
    """No value meets the conditions of a number."""


@dataclass(frozen=True)
class Measured:
    """A number as it was found; `holds` is None where nothing is said of what it should be."""

    number: Number
    value: float
    holds: bool | None
    problem: str = ""

    @property
    def wanted(self) -> str:
        """What it should be, in words."""
        number, parts = self.number, []
        if number.tolerance is not None:
            parts.append(f"{number.should_be:g} ± {number.tolerance:g}")
        if number.factor is not None:
            parts.append(f"{number.should_be:g} within a factor of {number.factor:g}")
        if number.at_least is not None:
            parts.append(f"at least {number.at_least:g}")
        if number.at_most is not None:
            parts.append(f"at most {number.at_most:g}")
        return ", ".join(parts)


def measure(item: Item, done: Mapping[str, Done]) -> list[Measured]:
    """Read all numbers of an item; `done` holds its cases by name."""
    return [_measured(item, number, done) for number in item.number]


def verdict(item: Item, measured: list[Measured], problems: list[str]) -> str:
    """Return what the item says of the source."""
    if problems or any(one.problem for one in measured):
        return FAILED
    deciding = [one for one in measured if one.holds is not None]
    if any(not one.holds for one in deciding if not one.number.quote):
        return MISSED
    if item.verdict:
        return item.verdict
    quoted = [one for one in deciding if one.number.quote]
    if not quoted:
        return HELD
    choices = {one.number.choice for one in quoted} - {""} or {""}
    kept = [all(one.holds for one in quoted if one.number.choice in ("", choice)) for choice in choices]
    return AGREES if all(kept) else DEPENDS if any(kept) else CONTRADICTS


def table_rows(table: Table, file: h5py.File) -> list[list[str]]:
    """Return the rows of a table as text."""
    columns = [_values(file, name).reshape(-1) for name in table.datasets]
    if table.magnitude:
        columns = [np.abs(column) for column in columns]
    count = min(column.size for column in columns)
    rows = np.arange(count)
    if table.order:
        rows = np.argsort(-columns[table.order - 1][:count], kind="stable")
    texts = [[f"{column[row]:.{table.digits}f}".rstrip("0").rstrip(".") for column in columns] for row in rows]
    if table.take:
        texts = [texts[row] for row in table.take]
        texts = [[*before, *row] for before, row in zip(table.printed or [()] * len(texts), texts, strict=True)]
    if table.number:
        texts = [[*text, str(row + 1)] for text, row in zip(texts, rows, strict=True)]
    return texts[: table.rows]


def _measured(item: Item, number: Number, done: Mapping[str, Done]) -> Measured:
    try:
        value = _read(item, number, done)
    except NothingThereError as cause:
        # Of what is only shown that may be so, such as of a window in speeds that a quick report passes over.
        needed = number.decides and not number.optional
        return Measured(number, np.nan, False, str(cause)) if needed else Measured(number, np.nan, None)
    except (ResultError, ArithmeticError, LookupError, TypeError, ValueError) as cause:
        return Measured(number, np.nan, False if number.decides else None, str(cause))
    holds = None
    if number.decides:
        holds = (
            (number.tolerance is None or abs(value - number.should_be) <= number.tolerance)
            and (number.factor is None or 1.0 / number.factor <= value / number.should_be <= number.factor)
            and (number.at_least is None or value >= number.at_least)
            and (number.at_most is None or value <= number.at_most)
        )
    return Measured(number, value, holds)


def _read(item: Item, number: Number, done: Mapping[str, Done]) -> float:
    values = _selected(number, done[item.case_called(number.case).name])
    if number.reduced:
        values = np.atleast_1d(_reduce(values, number))
    for other, combine in ((number.minus, np.subtract), (number.over, np.divide)):
        if other is not None:
            beside = _selected(number, done[other])
            values = combine(values, _reduce(beside, number) if number.reduced else beside)
    if number.magnitude:
        values = np.abs(values)
    scale = 1.0 if number.reduced and number.over else number.scale
    return float(values[0] if number.reduced else _reduce(values, number)) * scale


def _selected(number: Number, case: Done) -> NDArray[np.float64]:
    with open_hdf5(case.file) as file:
        names = [number.dataset, *(name for name, _, _ in number.where)]
        offsets = _offsets(file, names)
        values = _repeated(_values(file, number.dataset), number.dataset, offsets)
        if number.column is not None:
            values = values[..., number.column]
        elif values.ndim > 1 and values.shape[-1] == 1:
            values = values[..., 0]
        keep = np.ones(values.shape, dtype=bool)
        for name, condition, bound in number.where:
            of_input = isinstance(bound, str) and bound.startswith(INPUT)
            limit = _values(file, bound)[0] if of_input else bound
            found = _texts(file, name) if isinstance(limit, str) else _values(file, name)
            keep &= COMPARE[condition](_beside(values, _repeated(found, name, offsets)), limit)
        if number.reduce == "share":
            return keep.astype(np.float64)
        if number.at_largest:
            beside = np.where(keep, _beside(values, _values(file, number.at_largest)), -np.inf)
            keep &= beside == beside.max(initial=-np.inf)
        if number.where or number.at_largest:
            values = values[keep]
        return values if number.index is None else np.atleast_1d(values[number.index])


def _offsets(file: h5py.File, names: Sequence[str]) -> NDArray[np.int64] | None:
    """Return where the extrema of each point of a sweep begin, if any of the datasets is of extrema."""
    for name in names:
        group = name.rsplit("/", 1)[0]
        if name.startswith("/extrema/") and f"{group}/offset" in file:
            return file[f"{group}/offset"][()]
    return None


def _repeated(values: NDArray, name: str, offsets: NDArray[np.int64] | None) -> NDArray:
    """Return the values of points once for each extremum of theirs, where extrema are asked for."""
    return np.repeat(values, np.diff(offsets)) if name.startswith("/point/") and offsets is not None else values


def _beside(values: NDArray, found: NDArray) -> NDArray:
    """Return what is found in the shape of the values: one for each, or one for each along their first dimension."""
    if found.size != values.size and found.shape == values.shape[:1]:
        return np.broadcast_to(found.reshape(-1, *[1] * (values.ndim - 1)), values.shape)
    return found.reshape(values.shape)


def _texts(file: h5py.File, name: str) -> NDArray:
    with making_sense_of(file.filename):
        item = file.get(name)
        if not isinstance(item, h5py.Dataset):
            raise ResultError(f"no dataset '{name}'")
        check_storage(item)
        return np.array([text(value) for value in item[()].flat])


def _of_input(file: h5py.File, name: str) -> NDArray[np.float64]:
    """Return the value of a key of the input, ``group(number)%key``, or one of its values, ``group%key(number)``."""
    found = re.fullmatch(r"(\w+)(?:\((\d+)\))?%(\w+)(?:\((\d+)\))?", name)
    group = f90nml.reads(str(file.attrs["input"])).get(found[1]) if found else None
    groups = group if isinstance(group, list) else [group] if group else []
    number = int(found[2] or 1) if found else 0
    if number > len(groups) or not found or found[3] not in groups[number - 1]:
        raise ResultError(f"the input has no '{name}'")
    values = np.atleast_1d(np.asarray(groups[number - 1][found[3]], dtype=np.float64))
    if found[4] is None:
        return values
    if not 1 <= int(found[4]) <= values.size:
        raise ResultError(f"the input has no '{name}'")
    return values[[int(found[4]) - 1]]


@cache
def _of_check(file: str, name: str) -> NDArray[np.float64]:
    """Return what razy-check says of each motion of a file of razy-follow, or of each special point: 0 is proved."""
    from razy.check.verdict import KINDS, verdicts

    with open_hdf5(file) as data:
        if "point/state" not in data or name not in ("motion", "special"):
            raise ResultError(f"no '{CHECK}{name}' (of razy-follow: {CHECK}motion, {CHECK}special)")
        count = data["point/state"].shape[0]
    found = verdicts(file, range(count))
    if name == "special":
        found = [special for motion in found for special in motion.specials.values()]
    return np.array([KINDS.index(one.kind) for one in found], dtype=np.float64)


def _values(file: h5py.File, name: str) -> NDArray[np.float64]:
    if name.startswith(INPUT):
        return _of_input(file, name.removeprefix(INPUT))
    if name.startswith(CHECK):
        return _of_check(file.filename, name.removeprefix(CHECK))
    if name.endswith(RPM):
        # Rounded, so that a speed that was given in rpm is that speed.
        return np.round(_values(file, name.removesuffix(RPM)) * (30.0 / np.pi), 9)
    with making_sense_of(file.filename):
        item = file.get(name)
        if not isinstance(item, h5py.Dataset):
            raise ResultError(f"no dataset '{name}'")
        check_storage(item)
        return np.atleast_1d(np.asarray(item[()], dtype=np.float64))


def _reduce(values: NDArray[np.float64], number: Number) -> float:
    if number.reduce == "count":
        return values.size
    least = 3 if number.reduce == "ratio_of_intervals" else 1
    if values.size < least:
        found = f"{values.size} of {least} values" if values.size else "no value"
        raise NothingThereError(f"{number.dataset}: {found} to take the {number.reduce} of")
    return {
        "first": lambda: values.flat[0],
        "last": lambda: values.flat[-1],
        "spread": lambda: np.ptp(values),
        "share": values.mean,
        "share_positive": lambda: np.mean(values > 0.0),
        "max_over_min": lambda: values.max() / values.min(),
        "last_over_first": lambda: values.flat[-1] / values.flat[0],
        "ratio_of_intervals": lambda: np.divide(*np.diff(values.flat[-3:])),
    }.get(number.reduce, lambda: getattr(np, number.reduce)(values))()
