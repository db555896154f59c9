"""Amplitude spectra of a motion, over time or orders, and of several motions over a parameter."""

from collections.abc import Sequence
from dataclasses import replace

import f90nml
import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from razy.errors import ResultError
from razy.plot import style
from razy.plot.options import PlotOptions
from razy.plot.sampled import Course, period_of
from razy.plot.signals import signals
from razy.plot.units import LABEL_WIDTH, Scale, axis_label, readable_name, scale_for
from razy.read import Quantity, RunResult

MOST_PANELS = 4
# Amplitudes below this share of the largest are not shown.
RANGE = 1e-6
# The time-frequency picture: times in a window, at least, and windows side by side in the motion.
LEAST_WINDOW = 64
WINDOWS = 12
# Order cuts in one picture.
ORDERS = 4
# Lines of orders nearer to one another than this share of the height are not all named.
NEAR = 0.04
# The order map: turns in a window at most and at least, windows side by side in the motion, and windows in all at most.
MOST_TURNS, LEAST_TURNS, TURNED_WINDOWS, MOST_WINDOWS = 16, 2, 12, 400


def spectrum(value: NDArray[np.float64], step: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return frequencies, Hz, and amplitudes of a signal (…, times) at times `step` s apart, its mean taken off.

    The window is Hann's, scaled so that a sine on one of the frequencies has its amplitude.
    """
    count = value.shape[-1]
    window = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(count) / count)
    moved = (value - value.mean(axis=-1, keepdims=True)) * window
    return np.fft.rfftfreq(count, step), np.abs(np.fft.rfft(moved)) * 2 / window.sum()


def draw_spectrum(result: RunResult, figure: Figure, options: PlotOptions) -> None:
    """Draw amplitudes over the frequency, one signal above the other, and a line where the excitation repeats."""
    chosen = signals(result, options, MOST_PANELS)
    style.set_size(figure, options, 16.0, 3.0 + 4.5 * len(chosen))
    column = figure.subplots(len(chosen), 1, sharex=True, squeeze=False)[:, 0]
    period, top = period_of(result, options), 0.0
    for axes, signal in zip(column, chosen, strict=True):
        step, value = Course(result, signal, options).even()
        frequency, amplitude = spectrum(value, step)
        top = max(top, float(frequency[-1]))
        largest = float(amplitude[1:].max())
        if not largest > 0.0:
            raise ResultError(f"{result.path}: '{signal.value.name}' is constant {options.range_text()}")
        scale = scale_for(signal.value.units, largest)
        axes.semilogy(frequency[1:], amplitude[1:] * scale.factor, color=style.BLACK, label=signal.value.name)
        style.set_log_axis(axes.yaxis)
        axes.set_ylim(RANGE * largest * scale.factor, 3 * largest * scale.factor)
        axes.set_ylabel(_amplitude_label(signal.value, scale))
        if period is not None:
            axes.axvline(1 / period, color=style.RED, linewidth=0.6, linestyle="--", zorder=0, label="excitation")
    column[-1].set_xlabel("frequency (Hz)")
    column[-1].set_xlim(0.0, options.top or top)
    handles = [] if period is None else [Line2D([], [], color=style.RED, linewidth=0.6, linestyle="--",
                                                label=f"excitation, {1 / period:.4g} Hz")]  # fmt: skip
    style.set_footer(figure, result, options)
    style.set_heading(figure, (column[0], column[0]), style.title_of(result, options), handles)


def draw_spectrogram(result: RunResult, figure: Figure, options: PlotOptions) -> None:
    """Draw amplitudes over time and frequency: spectra of windows that overlap by three quarters."""
    chosen = signals(result, options, MOST_PANELS)
    style.set_size(figure, options, 16.0, 2.0 + 5.5 * len(chosen))
    column = figure.subplots(len(chosen), 1, sharex=True, squeeze=False)[:, 0]
    for axes, signal in zip(column, chosen, strict=True):
        course = Course(result, signal, options)
        step, value = course.even()
        length = max(value.size // WINDOWS, LEAST_WINDOW)
        if value.size < 2 * length:
            raise ResultError(f"{result.path}: fewer than {2 * length} stored times {options.range_text()}")
        parts = np.lib.stride_tricks.sliding_window_view(value, length)[:: length // 4]
        frequency, amplitude = spectrum(parts, step)
        middle = course.time[0] + step * (np.arange(len(parts)) * (length // 4) + 0.5 * length)
        scale = scale_for(signal.value.units, float(amplitude.max()))
        _colours(figure, axes, (middle, frequency[1:], amplitude[:, 1:].T), signal.value, scale)
        axes.set_ylabel("frequency (Hz)")
        axes.set_ylim(0.0, options.top or frequency[-1])
    column[-1].set_xlabel("time (s)")
    style.set_footer(figure, result, options)
    style.set_heading(figure, (column[0], column[0]), style.title_of(result, options), [])


def draw_order_map(result: RunResult, figure: Figure, options: PlotOptions) -> None:
    """Draw amplitudes over speed and order of a run-up or run-down: spectra of windows of equal numbers of turns."""
    if result.rotation is None:
        raise ResultError(f"{result.path}: the speed does not change (&rotation acceleration_rpm_per_s)")
    chosen = signals(result, options, MOST_PANELS)
    style.set_size(figure, options, 16.0, 2.0 + 5.5 * len(chosen))
    column = figure.subplots(len(chosen), 1, sharex=True, squeeze=False)[:, 0]
    for axes, signal in zip(column, chosen, strict=True):
        speed, order, amplitude = order_map(Course(result, signal, options), result)
        shown = slice(1, None if options.top is None else max(3, int(np.searchsorted(order, options.top, "right"))))
        scale = scale_for(signal.value.units, float(amplitude.max()))
        _colours(figure, axes, (speed, order[shown], amplitude[:, shown].T), signal.value, scale)
        axes.set_ylabel(f"order (apart by {order[1]:.2g}, stored to {order[-1]:.3g})")
        axes.set_ylim(0.0, options.top or order[-1])
    column[-1].set_xlabel("speed (rpm)")
    style.set_footer(figure, result, options)
    style.set_heading(figure, (column[0], column[0]), style.title_of(result, options), [])


def order_map(
    course: Course, result: RunResult
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return speeds, rpm, orders, and the amplitudes there (speeds, orders).

    The signal is taken at even angles (order tracking), in each window as densely as it is stored, so that nothing
    above half of that frequency is taken for something lower.
    """
    at, speed = result.rotation
    change = (speed[1] - speed[0]) / (at[1] - at[0])
    first, last = course.time[[0, -1]]
    begin, end = speed[0] + change * (first - at[0]), speed[0] + change * (last - at[0])
    if begin * end < 0.0:
        raise ResultError(f"{result.path}: the rotation changes its direction; --from and --to choose one")
    sign = np.sign(begin + end)
    begin, change = sign * begin, sign * change
    total = (begin + sign * end) / 2 * (last - first) / (2 * np.pi)
    turns = min(MOST_TURNS, int(total / TURNED_WINDOWS))
    if turns < LEAST_TURNS:
        raise ResultError(f"{result.path}: fewer than {LEAST_TURNS * TURNED_WINDOWS} turns in the range")
    step = course.step

    def when(turned: NDArray[np.float64]) -> NDArray[np.float64]:
        angle = 2 * np.pi * turned
        root = np.sqrt(np.maximum(begin**2 + 2 * change * angle, 0.0))
        return np.clip(first + 2 * angle / np.maximum(begin + root, 1e-300), first, last)

    starts = np.linspace(0.0, total - turns, min(MOST_WINDOWS, int(4 * (total / turns - 1)) + 1))
    spectra, speeds = [], []
    for start in starts:
        t0, middle, t1 = when(np.array([start, start + turns / 2, start + turns]))
        count = max(int((t1 - t0) / step), 2 * turns)
        spectra.append(spectrum(course.at(when(start + turns * np.arange(count) / count)), turns / count)[1])
        speeds.append((begin + change * (middle - first)) * 30 / np.pi)
    orders = min(part.size for part in spectra)
    return np.asarray(speeds), np.arange(orders) / turns, np.stack([part[:orders] for part in spectra])


def draw_waterfall(results: Sequence[RunResult], figure: Figure, options: PlotOptions) -> None:
    """Draw spectra of motions over the value of the input in which they differ; over the speed with lines of orders."""
    name, values = _parameter(results, "waterfall")
    order = np.argsort(values)
    signal = signals(results[0], options, 1)[0]
    # Where motions differ in number and distance of times, the coarsest decides.
    spectra = []
    for index in order:
        chosen = signals(results[index], options, 1)[0]
        spectra.append(spectrum(*reversed(Course(results[index], chosen, options).even())))
    frequency = np.linspace(0.0, min(f[-1] for f, _ in spectra), max(f.size for f, _ in spectra))
    amplitude = np.stack([np.interp(frequency, *pair) for pair in spectra], axis=1)
    scale = scale_for(signal.value.units, float(amplitude.max()))
    style.set_size(figure, options, 16.0, 11.0)
    axes = figure.subplots()
    at = np.asarray(values)[order]
    _colours(figure, axes, (at, frequency[1:], amplitude[1:]), signal.value, scale)
    top = options.top or float(frequency[-1])
    period = period_of(results[order[-1]], options)
    if name == "rotation.speed_rpm" and period is not None:
        turns = 60.0 / (period * at[-1])
        named = -np.inf
        for multiple in range(1, min(6, int(top * period) + 1)):
            line = multiple * turns * at / 60.0
            axes.plot(at, line, color="white", linewidth=0.5, linestyle="--", label=f"order {multiple * turns:g}")
            if line[0] - named > NEAR * top:
                axes.annotate(f"{multiple * turns:g}\N{MULTIPLICATION SIGN}", (at[0], line[0]), (3, 2), fontsize=7.0,
                              textcoords="offset points", color="white")  # fmt: skip
                named = line[0]
    axes.set_xlabel(_parameter_label(name))
    axes.set_ylabel("frequency (Hz)")
    axes.set_ylim(0.0, top)
    style.set_footer(figure, results[0], options)
    style.set_heading(figure, (axes, axes), style.title_of(results[0], options), [])


def draw_orders(results: Sequence[RunResult], figure: Figure, options: PlotOptions) -> None:
    """Draw order cuts: amplitudes at the first multiples of the excitation's frequency, over what differs."""
    name, values = _parameter(results, "picture of orders")
    signal = signals(results[0], options, 1)[0]
    rows = np.argsort(values)
    at, first = np.asarray(values)[rows], 1.0
    period = period_of(results[rows[-1]], options)
    if period is None:
        raise ResultError(f"{results[0].path}: nothing excites the motion with a period; give one (--period)")
    if name == "rotation.speed_rpm":
        first = round(60.0 / (period * at[-1]), 9)
    orders = first * np.arange(1, ORDERS + 1)
    cuts = np.empty((ORDERS, rows.size))
    for column, index in enumerate(rows):
        step, value = Course(results[index], signals(results[index], options, 1)[0], options).even()
        base = 1.0 / (period_of(results[index], options) or period)
        cuts[:, column] = [amplitude_at(value, step, k * base) for k in range(1, ORDERS + 1)]
    scale = scale_for(signal.value.units, float(np.nanmax(cuts)))
    style.set_size(figure, options, 16.0, 9.0)
    axes = figure.subplots()
    for order, cut, colour in zip(orders, cuts, (style.BLACK, *style.EVENT_COLOURS), strict=False):
        text = (
            f"order {order:g}" if name == "rotation.speed_rpm" else f"{order:g}\N{MULTIPLICATION SIGN} the excitation"
        )
        axes.plot(at, cut * scale.factor, color=colour, marker="o", markersize=2.0, label=text)
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel(_parameter_label(name))
    axes.set_ylabel(_amplitude_label(signal.value, scale))
    style.set_footer(figure, results[0], options)
    style.set_heading(figure, (axes, axes), style.title_of(results[0], options), list(axes.lines))


def amplitude_at(value: NDArray[np.float64], step: float, frequency: float) -> float:
    """Return the amplitude of a signal at one frequency, Hz, by Hann's window; NaN above half the sampling rate."""
    if frequency * step > 0.5:
        return np.nan
    count = value.size
    window = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(count) / count)
    turning = np.exp(-2j * np.pi * frequency * step * np.arange(count))
    return float(2 * abs((window * (value - value.mean())) @ turning) / window.sum())


def _parameter_label(name: str) -> str:
    unit = "rpm" if name.endswith("_rpm") else ""
    return readable_name(Quantity(name, unit, name)) + (f" ({unit})" if unit else "")


def _colours(figure: Figure, axes, data: tuple[NDArray, NDArray, NDArray], value: Quantity, scale: Scale) -> None:
    x, y, amplitude = data
    largest = float(amplitude.max()) * scale.factor
    if not largest > 0.0:
        raise ResultError(f"'{value.name}' is constant in the range asked for")
    image = axes.pcolormesh(x, y, np.maximum(amplitude * scale.factor, 1e-4 * largest), cmap="magma", rasterized=True,
                            norm=LogNorm(1e-4 * largest, largest), shading="nearest")  # fmt: skip
    bar = figure.colorbar(image, ax=axes, pad=0.02)
    style.set_log_axis(bar.ax.yaxis)
    bar.set_label(_amplitude_label(value, scale))


def _amplitude_label(value: Quantity, scale: Scale) -> str:
    return axis_label(replace(value, long_name=f"amplitude of {readable_name(value)}"), scale, LABEL_WIDTH)


def _parameter(results: Sequence[RunResult], what: str) -> tuple[str, list[float]]:
    """Return the one number of the input in which motions differ, and its values."""
    inputs = [_numbers(f90nml.reads(result.input)) for result in results]
    differ = [key for key in inputs[0] if len({one.get(key) for one in inputs}) > 1 and not key.startswith("record")]
    differ = [key for key in differ if all(key in one for one in inputs)]
    if len(results) < 2 or not differ:
        raise ResultError(f"{results[0].path}: a {what} is of motions that differ in a number of the input")
    # Of several that vary together the first names the picture.
    name = differ[0]
    if len({one[name] for one in inputs}) < len(inputs):
        raise ResultError(f"{results[0].path}: two of the motions have the same {name}")
    return name, [one[name] for one in inputs]


def _numbers(groups: dict) -> dict[str, float]:
    found = {}
    for name, members in groups.items():
        several = members if isinstance(members, list) else [members]
        for number, group in enumerate(several, 1):
            place = f"{name}({number})" if len(several) > 1 else name
            found |= {f"{place}.{key}": value for key, value in group.items() if isinstance(value, float | int)}
    return found
