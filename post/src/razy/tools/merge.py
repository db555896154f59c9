"""Sweeps of neighbouring ranges made into one file.

The files are those of ``razy-sweep`` that differ in the values of one parameter, or in the direction of their chains,
and are alike in everything else: program, inputs but for ``&sweep``, other parameters, number of starts. Points are put
in the order of the parameter; of a value that ends one range and begins the next the file that comes first counts.
Chains cannot be merged along the parameter that they follow: at the first value of the second range a chain began
anew, which in one chain over both it would not. Extrema are copied in parts, so they need not fit in memory. The
attribute ``input`` is that of the first range; ``merged`` names the files.

Points are an array of shape (directions, starts, values of the outer parameter, values of the inner one); a file is a
slab of it. What a file of the result consists of, row by row, is a list of spans, each of one file.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

from razy.errors import ResultError
from razy.read import SweepResult, open_result
from razy.read.extrema import CHUNK_VALUES
from razy.read.file import making_sense_of
from razy.target import check_output, replacing_hdf5

OFFSET = "offset"
KNOWN = {"attractor", "average", "axis", "contact", "extrema", "point", "scene", "strobe"}
BOUNDARIES = {"boundary": "boundary", "row": "row", "extremum": "row"}
DIRECTIONS, STARTS, OUTER, INNER = range(4)


@dataclass(frozen=True)
class Source:
    """A file, the shape of its points, and the values of the merged dimension that are taken."""

    result: SweepResult
    shape: tuple[int, ...]
    taken: range


@dataclass(frozen=True)
class Span:
    """Rows from `start` up to `stop` of a file."""

    source: Source
    start: int
    stop: int


@dataclass(frozen=True)
class Plan:
    """What is merged: the files in order, the dimension along which they follow each other, and its parameter."""

    sources: list[Source]
    dimension: int
    parameter: str | None

    def spans(self, without: int | None = None) -> list[Span]:
        """Rows of the result in order; `without` leaves out a dimension that the rows do not have."""
        spans = []
        shapes = [[1 if k == without else n for k, n in enumerate(source.shape)] for source in self.sources]
        outer = int(np.prod(shapes[0][: self.dimension], dtype=int))
        inner = int(np.prod(shapes[0][self.dimension + 1 :], dtype=int))
        for block in range(outer):
            for source, shape in zip(self.sources, shapes, strict=True):
                first = block * shape[self.dimension]
                spans.append(Span(source, (first + source.taken.start) * inner, (first + source.taken.stop) * inner))
        return spans

    def place(self, index: int, points: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return which points of the result the points of a file are."""
        source = self.sources[index]
        where = list(np.unravel_index(points, source.shape))
        before = sum(len(other.taken) for other in self.sources[:index])
        where[self.dimension] = where[self.dimension] - source.taken.start + before
        shape = list(source.shape)
        shape[self.dimension] = sum(len(other.taken) for other in self.sources)
        return np.ravel_multi_index(tuple(where), tuple(shape))


def merge(paths: list[Path], output: Path, overwrite: bool = False) -> int:
    """Merge sweeps; return the number of points of the result.

    Raises
    ------
    ResultError
        The files are not sweeps that belong together, or the output exists.
    """
    check_output(output, paths, overwrite)
    results = []
    try:
        for path in paths:
            result = open_result(path)
            results.append(result)
            if not isinstance(result, SweepResult):
                raise ResultError(f"{path}: not a file of razy-sweep")
        with making_sense_of(", ".join(map(str, paths))):
            plan = _arrange(results)
            with replacing_hdf5(output) as file:
                return _write(file, plan)
    finally:
        for result in results:
            result.close()


def _arrange(results: list[SweepResult]) -> Plan:
    """Check that the files belong together, and put them in order."""
    first = results[0]
    for other in results[1:]:
        _check_alike(first, other)
    unknown = set(first.file) - KNOWN
    if unknown:
        raise ResultError(f"{first.path}: '/{min(unknown)}' cannot be merged")
    parameters = _in_order(first)
    differing = [
        name
        for name in parameters
        if any(not np.array_equal(first.axis(name), other.axis(name)) for other in results[1:])
    ]
    if len(differing) > 1:
        raise ResultError(f"{results[1].path}: other values of {differing[1]} than {first.path}")
    ways = [_ways(result) for result in results]
    if differing and any(way != ways[0] for way in ways):
        raise ResultError(f"{first.path}: the files differ both in {differing[0]} and in the direction of their chains")
    if not differing and all(len(way) == 1 for way in ways) and len(set(ways)) == len(ways) > 1:
        ordered = sorted(results, key=lambda result: -_ways(result)[0])
        return Plan([Source(result, _shape(result, parameters), range(1)) for result in ordered], DIRECTIONS, None)
    name = differing[0] if differing else parameters[0]
    if first.direction is not None and name == parameters[0]:
        raise ResultError(
            f"{results[-1].path}: its chains follow {name}, and began anew at the first value: one chain over all "
            "ranges has other motions there. Ranges of another parameter, or the ways up and down, can be merged"
        )
    return Plan(_by_value(results, name, parameters), OUTER if name == parameters[0] else INNER, name)


def _check_alike(first: SweepResult, other: SweepResult) -> None:
    for name in ("razy_version", "git_commit", "integrator", "treatment"):
        mine, theirs = (result.attributes().get(name, "") for result in (first, other))
        if mine != theirs:
            raise ResultError(f"{other.path}: {name} is '{theirs}', but '{mine}' in {first.path}")
    if _without_sweep(first.input) != _without_sweep(other.input):
        raise ResultError(f"{other.path}: computed from another input than {first.path} (beyond its &sweep)")
    if (first.parameters, first.observables) != (other.parameters, other.observables):
        raise ResultError(f"{other.path}: other parameters or observables than {first.path}")
    if first.n_starts != other.n_starts:
        raise ResultError(f"{other.path}: {other.n_starts} starts of each point, but {first.n_starts} in {first.path}")


def _in_order(result: SweepResult) -> list[str]:
    """Return the parameters, the one that runs slowest first: where the file does not say so, as its points do."""
    if "coordinates" in result.file["point/status"].attrs:
        return list(result.parameters)
    return sorted(result.parameters, key=lambda name: name != result.outer_parameter)


def _ways(result: SweepResult) -> tuple[int, ...]:
    """Return the directions of the chains, +1 and -1; (0,) where each point stands alone."""
    direction = result.direction
    return (0,) if direction is None else tuple(int(way) for way in direction[:: result.n_grid * result.n_starts])


def _shape(result: SweepResult, parameters: list[str]) -> tuple[int, ...]:
    sizes = [result.axis(name).size for name in parameters]
    return (len(_ways(result)), result.n_starts, *(sizes if len(sizes) == 2 else [*sizes, 1]))


def _by_value(results: list[SweepResult], name: str, parameters: list[str]) -> list[Source]:
    """Put files in the order of a parameter, and find out which of its values are taken from each."""
    sign = -1 if any(np.any(np.diff(result.axis(name)) < 0) for result in results) else 1
    sources: list[Source] = []
    last = -np.inf
    for result in sorted(results, key=lambda result: sign * result.axis(name)[0]):
        values = sign * result.axis(name)
        if np.any(np.diff(values) <= 0) or values[0] < last:
            raise ResultError(f"{result.path}: its range overlaps another, or runs the other way")
        sources.append(
            Source(result, _shape(result, parameters), range(int(np.count_nonzero(values <= last)), values.size))
        )
        last = max(last, values[-1])
    return sources


def _without_sweep(text: str) -> str:
    return re.sub(r"(?ms)^&sweep\b.*?^/\s*$|^&sweep\b[^\n]*/\s*$", "", text)


def _write(file: h5py.File, plan: Plan) -> int:
    sources = plan.sources
    first = sources[0].result
    for name, value in first.file.attrs.items():
        file.attrs[name] = value
    file.attrs["merged"] = ", ".join(Path(source.result.path).name for source in sources)
    for name, model in first.file["axis"].items():
        parts = [model[()]]
        if name == plan.parameter:
            parts = [source.result.axis(name)[source.taken.start : source.taken.stop] for source in sources]
        _copy(file, model, parts)
    spans = plan.spans()
    points = _length(spans)
    for name, model in first.file["point"].items():
        if name == "point":
            _dimension(file, model, points)
        elif model.is_scale:
            first.file.copy(model, file["point"], name)
        else:
            _copy(file, model, _rows(spans, model.name))
    for group in {"average", "contact"} & set(first.file):
        _dimension(file, first.file[f"{group}/point"], points)
    for model in [
        model
        for group, names in (("contact", first.contacts), ("average", first.averages))
        for name in names
        for model in first.file[f"{group}/{name}"].values()
    ]:
        if model.shape != (first.n_points,):
            raise ResultError(f"{first.path}: '{model.name}' has not one value for each point: it cannot be merged")
        _copy(file, model, _rows(spans, model.name))
    for path in [f"extrema/{name}" for name in first.observables] + [f"strobe/{name}" for name in first.strobes]:
        _write_ragged(file, spans, path)
    if "attractor" in first.file:
        _write_attractors(file, plan)
    if "scene" in first.file:
        first.file.copy("scene", file)
    _attach_scales(file, first.file)
    return points


def _length(spans: list[Span]) -> int:
    return sum(span.stop - span.start for span in spans)


def _rows(spans: list[Span], path: str) -> list[NDArray]:
    """Read the rows of the spans, each file once."""
    whole = {id(span.source): span.source.result.file[path][()] for span in spans}
    return [whole[id(span.source)][span.start : span.stop] for span in spans]


def _write_ragged(file: h5py.File, spans: list[Span], path: str) -> list[Span]:
    """Write a group of lists, one for each row of the spans; return the spans of what is in the lists."""
    offset = {id(span.source): span.source.result.file[path][OFFSET][()] for span in spans}
    offsets, inside, total = [np.zeros(1, dtype=np.int64)], [], 0
    for span in spans:
        part = offset[id(span.source)][span.start : span.stop + 1]
        offsets.append(part[1:] - part[0] + total)
        inside.append(Span(span.source, int(part[0]), int(part[-1])))
        total += inside[-1].stop - inside[-1].start
    for name, model in spans[0].source.result.file[path].items():
        if name == OFFSET:
            _copy(file, model, offsets)
        elif name in BOUNDARIES:
            _dimension(file, model, _length(spans) + 1 if BOUNDARIES[name] == "boundary" else total)
        elif name == "coordinate":
            _copy(file, model, [model[()]])
        else:
            target = _create(file, model, total)
            place = 0
            for span in inside:
                for part in _parts(span.start, span.stop):
                    target[place : place + part.stop - part.start] = span.source.result.file[model.name][part]
                    place += part.stop - part.start
    return inside


def _write_attractors(file: h5py.File, plan: Plan) -> None:
    """Write the attractors of each grid point and direction, and give the points they name their new numbers."""
    inside = _write_ragged(file, plan.spans(without=STARTS), "attractor")
    parts = []
    for span in inside:
        index = next(k for k, source in enumerate(plan.sources) if source is span.source)
        parts.append(plan.place(index, span.source.result.file["attractor/point"][span.start : span.stop]))
    file["attractor/point"][...] = np.concatenate(parts)


def _parts(start: int, stop: int) -> Iterator[slice]:
    for begin in range(start, stop, CHUNK_VALUES):
        yield slice(begin, min(begin + CHUNK_VALUES, stop))


def _copy(file: h5py.File, model: h5py.Dataset, parts: list[NDArray]) -> None:
    _create(file, model, sum(len(part) for part in parts))[...] = np.concatenate(parts)


def _create(file: h5py.File, model: h5py.Dataset, length: int) -> h5py.Dataset:
    item = file.create_dataset(model.name, shape=(length, *model.shape[1:]), dtype=model.dtype)
    for name, value in model.attrs.items():
        if name not in ("CLASS", "NAME", "REFERENCE_LIST", "DIMENSION_LIST", "_Netcdf4Dimid", "_Netcdf4Coordinates"):
            item.attrs[name] = value
    return item


def _dimension(file: h5py.File, model: h5py.Dataset, length: int) -> None:
    item = _create(file, model, length)
    item.make_scale(f"This is a netCDF dimension but not a netCDF variable. {length:9d}")


def _attach_scales(file: h5py.File, model: h5py.File) -> None:
    """Give every dataset the dimension scales that it has in a file."""
    items: list[h5py.Dataset] = []
    file.visititems(lambda _, item: items.append(item) if isinstance(item, h5py.Dataset) else None)
    for item in items:
        if model[item.name].is_scale and not item.is_scale:
            item.make_scale(item.name.rsplit("/", 1)[1])
    for item in items:
        if item.name.startswith("/scene/"):
            continue
        for mine, theirs in zip(item.dims, model[item.name].dims, strict=True):
            for scale in theirs.values() if not item.is_scale else ():
                mine.attach_scale(file[scale.name])
