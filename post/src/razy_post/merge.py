"""Sweeps of neighbouring ranges made into one file.

The files are those of ``razy-sweep`` over different ranges of its first parameter, alike in everything else: program,
inputs but for ``&sweep``, other parameters. Points are put in the order of the parameter; of a value that ends one
range and begins the next the file that comes first counts. Extrema are copied in parts, so they need not fit in memory.
The attribute ``input`` is that of the first range; ``merged`` names the files.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

from razy_post.errors import ResultError
from razy_post.read import SweepResult, open_result
from razy_post.read.extrema import CHUNK_VALUES

OFFSET = "offset"
KNOWN = {"axis", "contact", "extrema", "point", "scene"}


@dataclass(frozen=True)
class Source:
    """A file, its values of the merged parameter that are taken, and where they go."""

    result: SweepResult
    taken: NDArray[np.int64]


def merge(paths: list[Path], output: Path, overwrite: bool = False) -> int:
    """Merge sweeps; return the number of points of the result.

    Raises
    ------
    ResultError
        The files are not sweeps that belong together, or the output exists.
    """
    if output.exists() and not overwrite:
        raise ResultError(f"{output}: exists already; --force overwrites it")
    if output.resolve() in [path.resolve() for path in paths]:
        raise ResultError(f"{output}: is one of the files to be merged")
    results = []
    try:
        for path in paths:
            result = open_result(path)
            results.append(result)
            if not isinstance(result, SweepResult):
                raise ResultError(f"{path}: not a file of razy-sweep")
        sources, inner = _arrange(results)
        partial = output.with_name(output.name + ".partial")
        try:
            with h5py.File(partial, "w") as file:
                points = _write(file, sources, inner)
            partial.replace(output)
        finally:
            partial.unlink(missing_ok=True)
        return points
    finally:
        for result in results:
            result.close()


def _arrange(results: list[SweepResult]) -> tuple[list[Source], int]:
    """Check that the files belong together; return them in order, and the number of points of each value."""
    first = results[0]
    for other in results[1:]:
        for name in ("razy_version", "git_commit", "integrator", "treatment"):
            mine, theirs = (result.attributes().get(name, "") for result in (first, other))
            if mine != theirs:
                raise ResultError(f"{other.path}: {name} is '{theirs}', but '{mine}' in {first.path}")
        if _without_sweep(first.input) != _without_sweep(other.input):
            raise ResultError(f"{other.path}: computed from another input than {first.path} (beyond its &sweep)")
        if (first.parameters, first.observables) != (other.parameters, other.observables):
            raise ResultError(f"{other.path}: other parameters or observables than {first.path}")
    unknown = set(first.file) - KNOWN
    if unknown:
        raise ResultError(f"{first.path}: '/{min(unknown)}' cannot be merged")
    name = first.outer_parameter
    for result in results:
        if result.direction is not None or result.n_starts > 1:
            raise ResultError(
                f"{result.path}: has chains or several starts: a chain over both ranges is not two chains, and "
                "samples depend on the number of the point"
            )
    for other in results[1:]:
        for parameter in first.parameters:
            if parameter != name and not np.array_equal(first.axis(parameter), other.axis(parameter)):
                raise ResultError(f"{other.path}: other values of {parameter} than {first.path}")
    sign = -1 if any(np.any(np.diff(result.axis(name)) < 0) for result in results) else 1
    results = sorted(results, key=lambda result: sign * result.axis(name)[0])
    sources: list[Source] = []
    last = -np.inf
    for result in results:
        values = sign * result.axis(name)
        if np.any(np.diff(values) <= 0) or values[0] < last:
            raise ResultError(f"{result.path}: its range overlaps another, or runs the other way")
        sources.append(Source(result, np.flatnonzero(values > last)))
        last = max(last, values[-1])
    inner = int(np.prod([first.axis(parameter).size for parameter in first.parameters if parameter != name], dtype=int))
    return sources, inner


def _without_sweep(text: str) -> str:
    return re.sub(r"(?ms)^&sweep\b.*?^/\s*$|^&sweep\b[^\n]*/\s*$", "", text)


def _write(file: h5py.File, sources: list[Source], inner: int) -> int:
    first = sources[0].result
    for name, value in first.file.attrs.items():
        file.attrs[name] = value
    file.attrs["merged"] = ", ".join(Path(source.result.path).name for source in sources)
    outer = first.outer_parameter
    points = inner * sum(source.taken.size for source in sources)
    for group in ("axis", "point"):
        for name in first.file[group]:
            model = first.file[group][name]
            if group == "axis" and name != outer:
                _copy(file, model, [model[()]])
            elif name == "point":
                _dimension(file, model, points)
            else:
                each = 1 if group == "axis" else inner
                _copy(file, model, [_rows(source, f"{group}/{name}", each) for source in sources])
    if "contact" in first.file:
        _dimension(file, first.file["contact/point"], points)
    for contact in first.contacts:
        for quantity, model in first.file[f"contact/{contact}"].items():
            path = f"contact/{contact}/{quantity}"
            if model.shape != (first.n_points,):
                raise ResultError(f"{first.path}: '/{path}' has not one value for each point: it cannot be merged")
            _copy(file, model, [_rows(source, path, inner) for source in sources])
    for observable in first.observables:
        _write_extrema(file, sources, inner, f"extrema/{observable}")
    if "scene" in first.file:
        first.file.copy("scene", file)
    _attach_scales(file)
    return points


def _rows(source: Source, path: str, each: int) -> NDArray:
    """Read the rows of the values that are taken."""
    start, stop = _range(source, each)
    return source.result.file[path][start:stop]


def _range(source: Source, each: int) -> tuple[int, int]:
    if source.taken.size == 0:
        return 0, 0
    return int(source.taken[0]) * each, (int(source.taken[-1]) + 1) * each


def _write_extrema(file: h5py.File, sources: list[Source], inner: int, path: str) -> None:
    offsets, ranges, total = [np.zeros(1, dtype=np.int64)], [], 0
    for source in sources:
        start, stop = _range(source, inner)
        offset = source.result.file[path][OFFSET][start : stop + 1]
        offsets.append(offset[1:] - offset[0] + total)
        ranges.append((int(offset[0]), int(offset[-1])))
        total += ranges[-1][1] - ranges[-1][0]
    group = sources[0].result.file[path]
    for name, model in group.items():
        if name == OFFSET:
            _copy(file, model, offsets)
        elif name in ("boundary", "extremum"):
            _dimension(file, model, sum(part.size for part in offsets) if name == "boundary" else total)
        else:
            target = _create(file, model, total)
            place = 0
            for source, span in zip(sources, ranges, strict=True):
                for part in _parts(*span):
                    target[place : place + part.stop - part.start] = source.result.file[model.name][part]
                    place += part.stop - part.start


def _parts(start: int, stop: int) -> Iterator[slice]:
    for begin in range(start, stop, CHUNK_VALUES):
        yield slice(begin, min(begin + CHUNK_VALUES, stop))


def _copy(file: h5py.File, model: h5py.Dataset, parts: list[NDArray]) -> None:
    _create(file, model, sum(len(part) for part in parts))[...] = np.concatenate(parts)


def _create(file: h5py.File, model: h5py.Dataset, length: int) -> h5py.Dataset:
    item = file.create_dataset(model.name, shape=(length,), dtype=model.dtype)
    for name, value in model.attrs.items():
        if name not in ("CLASS", "NAME", "REFERENCE_LIST", "DIMENSION_LIST", "_Netcdf4Dimid", "_Netcdf4Coordinates"):
            item.attrs[name] = value
    return item


def _dimension(file: h5py.File, model: h5py.Dataset, length: int) -> None:
    item = _create(file, model, length)
    item.make_scale(f"This is a netCDF dimension but not a netCDF variable. {length:9d}")


def _attach_scales(file: h5py.File) -> None:
    """Give every dataset the dimension scale of its group."""
    for item in file["axis"].values():
        item.make_scale(item.name.rsplit("/", 1)[1])
    for group, scale in (("point", "point"), *((f"extrema/{name}", "extremum") for name in file.get("extrema", ()))):
        for name, item in file[group].items():
            if name == OFFSET:
                item.dims[0].attach_scale(file[group]["boundary"])
            elif name not in (scale, "boundary"):
                item.dims[0].attach_scale(file[group][scale])
    for group in file.get("contact", {}).values():
        for item in group.values() if isinstance(group, h5py.Group) else ():
            item.dims[0].attach_scale(file["contact/point"])
