"""Points or extrema of a sweep, or of branches, as a table of text: a line each, comma-separated, with all digits."""

import csv
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

import numpy as np

from razy.errors import ResultError
from razy.read import FollowResult, SweepResult
from razy.target import replacing


def write_extrema(result: SweepResult | FollowResult, observable: str, target: Path) -> int:
    """Write point, parameters, value and kind of each extremum of an observable; return the number of lines."""
    extrema = result.extrema(observable)
    grids = [result.grid(name) for name in result.parameters]
    quantities = [result.parameter(name) for name in result.parameters]
    header = ["point", *(f"{quantity.name} [{quantity.units}]" for quantity in quantities)]
    lines = 0
    with _opened(target) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*header, f"{observable} [{extrema.quantity.units}]", "kind"])
        for chunk in extrema.chunks():
            columns = [chunk.point, *(grid[chunk.point] for grid in grids), chunk.value, chunk.kind]
            writer.writerows(zip(*(column.tolist() for column in columns), strict=True))
            lines += chunk.point.size
    return lines


def write_points(result: SweepResult | FollowResult, target: Path) -> int:
    """Write parameters, start and all single numbers of each point; return the number of lines."""
    names = [f"{quantity.name} [{quantity.units}]" for quantity in map(result.parameter, result.parameters)]
    columns = [np.arange(result.n_points), *(result.grid(name) for name in result.parameters)]
    wanted = {*result.columns, "direction", "start"}
    for name, item in result.file.get("point", {}).items():
        if name in wanted or name.startswith("start."):
            names.append(name)
            columns.append(np.asarray(item[()]))
            if columns[-1].shape != columns[0].shape:
                raise ResultError(f"{result.path}: dataset '{item.name}' has not one value for each point")
    if isinstance(result, FollowResult):
        names += ["largest_multiplier", "label"]
        columns += [result.largest_multiplier, result.labels]
    with _opened(target) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["point", *names])
        writer.writerows(zip(*(column.tolist() for column in columns), strict=True))
    return int(columns[0].size)


@contextmanager
def _opened(target: Path) -> Iterator[TextIO]:
    """Write a file that appears when it is complete."""
    with replacing(target) as partial, partial.open("w", newline="", encoding="utf-8") as file:
        yield file
