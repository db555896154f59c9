"""Extrema of an observable: of one motion, and of a sweep's points as a ragged array read in parts."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import h5py
import numpy as np
from numpy.typing import NDArray

from razy.errors import ResultError
from razy.read.file import Quantity, ResultFile, choose, quantity_of

MAXIMUM = 1
MINIMUM = -1
UNKNOWN = 0

CHUNK_VALUES = 1 << 18


@dataclass(frozen=True)
class Extrema:
    """Extrema of one motion, in the order of time; all arrays have shape (extrema,).

    Attributes
    ----------
    value
        Value of the observable, in the file's units.
    time
        Time of the extremum in s; NaN where the file has none.
    kind
        `MAXIMUM`, `MINIMUM`, or `UNKNOWN` where the file does not say.
    """

    value: NDArray[np.float64]
    time: NDArray[np.float64]
    kind: NDArray[np.int8]


@dataclass(frozen=True)
class Chunk:
    """Extrema of some points of a sweep; all arrays have shape (values,); `point` counts from 0."""

    point: NDArray[np.int64]
    value: NDArray[np.float64]
    kind: NDArray[np.int8]


@dataclass(frozen=True)
class ExtremaData:
    """The datasets of one observable's extrema, of equal length; a razy file may leave out time and kind."""

    value: h5py.Dataset
    time: h5py.Dataset | None
    kind: h5py.Dataset | None

    def __post_init__(self) -> None:
        for item in (self.value, self.time, self.kind):
            if item is not None and (item.ndim != 1 or item.shape != self.value.shape):
                raise ResultError(
                    f"{item.file.filename}: dataset '{item.name}' has shape {item.shape}, "
                    f"expected ({self.value.shape[0] if self.value.ndim else 1},)"
                )

    def __len__(self) -> int:
        return int(self.value.shape[0])

    def quantity(self, observable: str) -> Quantity:
        """Describe the observable; its long name is that of the values without ``extrema of``."""
        described = quantity_of(self.value, observable)
        return replace(described, long_name=described.long_name.removeprefix("extrema of "))

    def values(self, part: slice) -> NDArray[np.float64]:
        """Read values `part`."""
        return np.asarray(self.value[part], dtype=np.float64)

    def kinds(self, part: slice) -> NDArray[np.int8]:
        """Read kinds `part`; `UNKNOWN` where the file has none or another value."""
        if self.kind is None:
            return np.full(part.stop - part.start, UNKNOWN, dtype=np.int8)
        kind = np.asarray(self.kind[part])
        return np.where(np.abs(kind) == MAXIMUM, kind, UNKNOWN).astype(np.int8)

    def read(self, part: slice) -> Extrema:
        """Read values, times and kinds `part`."""
        value = self.values(part)
        time = np.full(value.shape, np.nan) if self.time is None else np.asarray(self.time[part], dtype=np.float64)
        return Extrema(value, time, self.kinds(part))


class SweepExtrema:
    """Extrema of one observable at all points of a sweep.

    Parameters
    ----------
    quantity
        The observable, with its units.
    data
        Datasets with the values of all points, one point after the other.
    offset
        Shape (points + 1,); point i has the values ``offset[i]`` to ``offset[i + 1] - 1``, counted from 0.
    """

    def __init__(self, quantity: Quantity, data: ExtremaData, offset: NDArray[np.int64]) -> None:
        if offset[0] != 0 or offset[-1] != len(data) or np.any(np.diff(offset) < 0):
            raise ResultError(
                f"{data.value.file.filename}: offsets of the extrema of '{quantity.name}' do not rise from 0 to "
                f"{len(data)}, the number of values"
            )
        self.quantity = quantity
        self.offset = offset
        self.data = data

    def __len__(self) -> int:
        """Return the number of extrema at all points together."""
        return len(self.data)

    @property
    def counts(self) -> NDArray[np.int64]:
        """Number of extrema at each point, shape (points,)."""
        return np.diff(self.offset)

    def point(self, index: int) -> Extrema:
        """Read the extrema of one point, counted from 0."""
        points = self.offset.size - 1
        if not 0 <= index < points:
            raise IndexError(f"point {index} of {points}")
        return self.data.read(slice(int(self.offset[index]), int(self.offset[index + 1])))

    def all(self) -> Extrema:
        """Read the extrema of all points, one point after the other."""
        return self.data.read(slice(0, len(self)))

    def chunks(self, selected: NDArray[np.bool_] | None = None, size: int = CHUNK_VALUES) -> Iterator[Chunk]:
        """Read the extrema of the selected points in parts of at most `size` values.

        Parameters
        ----------
        selected
            Shape (points,), true for the points to read; all if it is left out.
        size
            Largest number of values in memory at a time. A point's extrema may be spread over several parts.
        """
        for first, last in _runs(selected, self.offset.size - 1):
            stop = int(self.offset[last])
            for start in range(int(self.offset[first]), stop, size):
                part = slice(start, min(start + size, stop))
                yield Chunk(self._points(part), self.data.values(part), self.data.kinds(part))

    def _points(self, part: slice) -> NDArray[np.int64]:
        """Return the point that each value of `part` belongs to."""
        first = int(np.searchsorted(self.offset, part.start, side="right")) - 1
        last = int(np.searchsorted(self.offset, part.stop, side="left"))
        edges = np.clip(self.offset[first : last + 1], part.start, part.stop)
        return np.repeat(np.arange(first, last), np.diff(edges))


class ExtremaFile(ResultFile):
    """A file with points, each of which has the extrema of some observables."""

    @property
    def n_points(self) -> int:
        """Number of points."""
        raise NotImplementedError

    @property
    def observables(self) -> tuple[str, ...]:
        """Names of the observables whose extrema were recorded."""
        return self._members("extrema", h5py.Group)

    @property
    def strobes(self) -> tuple[str, ...]:
        """Names of the observables whose values were recorded once in each period of the excitation."""
        return self._members("strobe", h5py.Group)

    def extrema(self, observable: str) -> SweepExtrema:
        """Open the extrema of an observable; only the offsets are read."""
        return self._lists("extrema", observable)

    def strobe(self, observable: str) -> SweepExtrema:
        """Open the values of an observable once in each period of the excitation; their kind is `UNKNOWN`."""
        return self._lists("strobe", observable)

    def _lists(self, of: str, observable: str) -> SweepExtrema:
        choose(observable, self._members(of, h5py.Group), "observable", self.path)
        group = f"{of}/{observable}"
        offset = np.asarray(self._vector(f"{group}/offset", self.n_points + 1)[()], dtype=np.int64)
        data = ExtremaData(self._dataset(f"{group}/value"), self._find(f"{group}/time"), self._find(f"{group}/kind"))
        return SweepExtrema(data.quantity(observable), data, offset)


def _runs(selected: NDArray[np.bool_] | None, points: int) -> list[tuple[int, int]]:
    """Return the ranges [first, last) of neighbouring selected points."""
    if selected is None:
        return [(0, points)]
    edges = np.flatnonzero(np.diff(np.concatenate(([False], selected, [False])).astype(np.int8)))
    return [(int(first), int(last)) for first, last in edges.reshape(-1, 2)]
