"""What a picture of one motion can show: coordinates and observables over time, with their rates of change."""

import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from razy.errors import ResultError
from razy.plot.options import PlotNote, PlotOptions
from razy.plot.units import per_second, readable_name
from razy.read import Quantity, RunResult

CHUNK_TIMES = 1 << 18
# Displacements that are smaller than this beside the largest are rounding.
ROUNDING = 1e-12
FORCES = ("N", "N m")

Reader = Callable[[slice], NDArray[np.float64]]
Pair = tuple[NDArray[np.float64], NDArray[np.float64]]


@dataclass(frozen=True)
class Signal:
    """A coordinate or observable of a motion.

    Attributes
    ----------
    value, rate
        Name and units of the signal and of its rate of change.
    read
        Reads the signal at the stored times of a slice.
    read_rate
        Reads the rate likewise; None where the file has none, and it is taken by differences.
    """

    value: Quantity
    rate: Quantity
    read: Reader
    read_rate: Reader | None

    @property
    def is_force(self) -> bool:
        """Whether it is a force or moment, which may jump at events."""
        return self.value.units in FORCES

    def over_time(self, time: NDArray[np.float64], part: slice) -> Iterator[Pair]:
        """Read (time, value) in parts."""
        for piece in _pieces(part):
            yield time[piece], self.read(piece)

    def path(self, time: NDArray[np.float64], part: slice) -> Iterator[Pair]:
        """Read (value, rate) in parts.

        A rate that the file does not hold is the difference quotient over neighbouring times, of second order between
        events; a time that is stored twice, as before and after an event, counts once.
        """
        for piece in _pieces(part):
            if self.read_rate is not None:
                yield self.read(piece), self.read_rate(piece)
                continue
            wide = slice(max(piece.start - 1, 0), min(piece.stop + 1, time.size))
            keep = np.diff(time[wide], prepend=-np.inf) > 0.0
            at, value = time[wide][keep], self.read(wide)[keep]
            if at.size < 2:
                continue
            inside = (at >= time[piece.start]) & (at <= time[piece.stop - 1])
            yield value[inside], np.gradient(value, at)[inside]


def signals(result: RunResult, options: PlotOptions, most: int) -> list[Signal]:
    """Return the signals asked for; else all observables, or all coordinates if there are none, but at most `most`."""
    if not result.has_trajectory:
        raise ResultError(f"{result.path}: missing dataset '/time': the motion was not stored over time")
    if options.observables or options.coordinates:
        return [observable(result, name) for name in options.observables] + [
            _coordinate(result, name) for name in options.coordinates
        ]
    make, names, option = observable, result.observables, "--observable"
    if not names:
        make, names, option = _coordinate, _moving(result), "--coordinate"
    if not names:
        raise ResultError(f"{result.path}: missing datasets '/observable/<name>' and '/state/displacement'")
    if len(names) > most:
        warnings.warn(
            f"drawing {', '.join(names[:most])}; choose others with {option}: {', '.join(names[most:])}",
            PlotNote,
            stacklevel=2,
        )
    return [make(result, name) for name in names[:most]]


def _moving(result: RunResult) -> tuple[str, ...]:
    """Return the coordinates that move, beside the largest of their unit, by more than rounding."""
    part = slice(0, result.time.size)
    largest: dict[str, tuple[str, float]] = {}
    for name in result.coordinates:
        sizes = [float(np.nanmax(np.abs(result.displacement(name, p)), initial=0.0)) for p in _pieces(part)]
        largest[name] = result.coordinate_quantity(name).units, max(sizes, default=0.0)
    tops: dict[str, float] = {}
    for unit, size in largest.values():
        tops[unit] = max(tops.get(unit, 0.0), size)
    if "m" in tops and "rad" in tops:
        # A rotation that is rounding has no larger one beside it: over a length of 1 m it would be a displacement.
        tops["rad"] = max(tops["rad"], tops["m"])
    moving = tuple(name for name, (unit, size) in largest.items() if size > ROUNDING * tops[unit])
    return moving or result.coordinates


def force_loop(result: RunResult, options: PlotOptions) -> Signal:
    """Return one observable with another in the place of its rate: a contact force over a deformation, if not named."""
    if not result.has_trajectory:
        raise ResultError(f"{result.path}: missing dataset '/time': the motion was not stored over time")
    names = options.observables
    if not names:
        forces = [name for name in result.observables if name.startswith("contact_force")]
        others = [name for name in result.observables if name not in forces]
        names = (*others[:1], *forces[:1])
    if len(names) != 2:
        raise ResultError(f"{result.path}: a loop needs two observables, over which and which: give --observable twice")
    return loop(*(observable(result, name) for name in names))


def loop(over: Signal, drawn: Signal) -> Signal:
    """Return a signal with another in the place of its rate."""
    return Signal(over.value, drawn.value, over.read, drawn.read)


def observable(result: RunResult, name: str) -> Signal:
    """Return an observable as a signal."""
    value = result.observable_quantity(name)
    rate = Quantity(name, per_second(value.units), f"rate of {readable_name(value)}")
    return Signal(value, rate, lambda part: result.observable(name, part), None)


def _coordinate(result: RunResult, name: str) -> Signal:
    plain = result.coordinate_quantity(name)
    rate = Quantity(name, per_second(plain.units), f"velocity of {readable_name(plain)}")
    motion = {"m": "displacement of ", "rad": "rotation of "}.get(plain.units, "")
    value = Quantity(name, plain.units, motion + readable_name(plain))
    return Signal(value, rate, lambda part: result.displacement(name, part), lambda part: result.velocity(name, part))


def _pieces(part: slice) -> Iterator[slice]:
    for start in range(part.start, part.stop, CHUNK_TIMES):
        yield slice(start, min(start + CHUNK_TIMES, part.stop))
