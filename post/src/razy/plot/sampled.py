"""Signals of a motion at other times than those stored: evenly spaced, or once in each period of the excitation."""

import warnings

import numpy as np
from numpy.typing import NDArray

from razy.errors import ResultError
from razy.plot.options import PlotNote, PlotOptions
from razy.plot.signals import Signal
from razy.read import RunResult

# Stored times whose distances differ by less than this are evenly spaced.
EVEN = 1e-6


class Course:
    """A signal and its rate over strictly rising times of the range asked for, s; both shape (times,)."""

    def __init__(self, result: RunResult, signal: Signal, options: PlotOptions) -> None:
        part, time = result.window(options.start, options.stop), result.time
        if part.stop - part.start < 4:
            raise ResultError(f"{result.path}: fewer than four stored times {options.range_text()}")
        # Where a time stands twice, as before and after an event, the later value counts.
        keep = np.diff(time[part], append=np.inf) > 0.0
        self.time, self.value = time[part][keep], signal.read(part)[keep]
        self.rate = (
            np.gradient(self.value, self.time, edge_order=2)
            if signal.read_rate is None
            else signal.read_rate(part)[keep]
        )

        self.fastest = result.fastest_excitation

    @property
    def step(self) -> float:
        """The mean distance of the times, s; a note where the fastest excitation stands at another frequency for it."""
        step = float((self.time[-1] - self.time[0]) / (self.time.size - 1))
        if self.fastest * step > 0.5 * (1 + EVEN):
            warnings.warn(
                f"fewer than two stored times in a period of the fastest excitation, {self.fastest:.5g} Hz, which "
                f"stands at another frequency here; &record interval below {0.5 / self.fastest:.3g} s shows it there",
                PlotNote,
                4,
            )
        return step

    def at(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the value at times of the range: cubic Hermite polynomials."""
        s, step, low, high, v, w = self._pieces(time)
        return low + (high - low) * s**2 * (3 - 2 * s) + s * (1 - s) * step * ((1 - s) * v - s * w)

    def rate_at(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the rate of these polynomials at times of the range."""
        s, step, low, high, v, w = self._pieces(time)
        return 6 * s * (1 - s) * (high - low) / step + (1 - s) * (1 - 3 * s) * v + s * (3 * s - 2) * w

    def _pieces(self, time: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
        """Return place within its interval, from 0 to 1, length, values and rates at both ends, of each time."""
        i = np.clip(np.searchsorted(self.time, time, side="right") - 1, 0, self.time.size - 2)
        step = self.time[i + 1] - self.time[i]
        return (time - self.time[i]) / step, step, self.value[i], self.value[i + 1], self.rate[i], self.rate[i + 1]

    def even(self) -> tuple[float, NDArray[np.float64]]:
        """Return the distance of evenly spaced times, s, and the value at them; a note where it is interpolated."""
        steps = np.diff(self.time)
        step = self.step
        if np.ptp(steps) <= EVEN * step:
            return step, self.value
        warnings.warn(
            "the stored times are not evenly spaced: interpolated (&record interval spaces them)", PlotNote, 3
        )
        return step, self.at(np.linspace(self.time[0], self.time[-1], self.time.size))


def period_of(result: RunResult, options: PlotOptions) -> float | None:
    """Return the period asked for, else that of the excitation, s; None if there is neither."""
    return options.period or result.excitation_period


def strobe(result: RunResult, options: PlotOptions) -> NDArray[np.float64]:
    """Return the times in the range at which a period begins; the first begins at 0."""
    period = period_of(result, options)
    if period is None:
        raise ResultError(f"{result.path}: nothing excites the motion with a period; give one (--period)")
    time = result.time[result.window(options.start, options.stop)]
    first, last = (time[0], time[-1]) if time.size else (0.0, 0.0)
    number = np.arange(np.ceil(first / period - EVEN), np.floor(last / period + EVEN) + 1)
    if number.size == 0:
        raise ResultError(f"{result.path}: no period of {period:g} s begins at a stored time {options.range_text()}")
    return np.clip(number * period, first, last)
