"""Campbell diagram: frequencies over the speed, lines of excitation, critical speeds and the stability limit."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from razy.errors import ResultError
from razy.plot import style
from razy.plot.labels import Room, write
from razy.plot.options import PlotOptions
from razy.read import ModesResult

RPM = 30.0 / np.pi
BLUE = "#1f5fa8"
# A whirl with more of one direction than this has its colour.
CLEAR = 0.5
# Unstable and undecided modes, as those of periodic motions.
LINES = {0: "--", -1: ":"}


def draw(result: ModesResult, figure: Figure, options: PlotOptions) -> None:
    """Draw branches over the speed in rpm: forward whirl red, backward blue; without speeds, frequencies as bars."""
    if options.observables or options.coordinates:
        raise ResultError(f"{result.path}: a file of razy-modes holds no observables")
    style.set_size(figure, options, 16.0, 11.0)
    axes = figure.subplots()
    axes.set_ylabel("frequency (Hz)")
    style.set_footer(figure, result, options)
    if not result.is_campbell:
        _bars(axes, result)
        axes.set_ylim(0.0, options.top)
        style.set_heading(figure, (axes, axes), style.title_of(result, options), [])
        return
    rpm = result.speed * RPM
    low = rpm[0] if options.start is None else options.start
    high = rpm[-1] if options.stop is None else options.stop
    top = _top(result, high) if options.top is None else options.top
    _branches(axes, result, rpm)
    _excitation(axes, result, rpm)
    if np.isfinite(result.stability_limit):
        axes.axvline(
            result.stability_limit * RPM, color=style.RED, linewidth=0.8, linestyle="-.", label="stability limit"
        )
    axes.set_xlabel("speed (rpm)")
    axes.set_xlim(low, high)
    axes.set_ylim(0.0, top)
    style.set_heading(figure, (axes, axes), style.title_of(result, options), _legend(result))
    style.lay_out(figure)
    _name_orders(axes, result)


def _name_orders(axes: Axes, result: ModesResult) -> None:
    """Write beside each line of excitation, near its end within the axes, which order it is."""
    speed, orders, frequency = result.critical
    (low, high), (_, top) = axes.get_xlim(), axes.get_ylim()
    texts = [f"{order:g}\N{MULTIPLICATION SIGN}" for order in np.unique(orders)]
    ends = [low + 0.96 * (min(high, 60.0 * top / order) - low) for order in np.unique(orders)]
    at = [(end, order * end / 60.0) for end, order in zip(ends, np.unique(orders), strict=True)]
    room = Room(axes, list(zip(speed * RPM, frequency, strict=True)), [line.get_data() for line in axes.lines])
    write(axes, [place for place in room.places(texts, at) if place is not None])


def _top(result: ModesResult, rpm: float) -> float:
    """Return the highest frequency to show: a little more than lines of excitation reach, no more than there is."""
    highest = 1.05 * float(np.nanmax(result.frequency))
    _, orders, critical = result.critical
    if orders.size == 0:
        return highest
    lowest = result.frequency[:, 0] if result.frequency.shape[1] else np.zeros(1)
    return min(highest, 1.25 * float(max(orders.max() * rpm / 60.0, critical.max(), np.nanmax(lowest))))


def _bars(axes: Axes, result: ModesResult) -> None:
    frequency = result.frequency[0]
    axes.bar(np.arange(1, frequency.size + 1), frequency, width=0.5, color=style.GREY, label="natural frequency")
    axes.set_xlabel("mode")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))


def _branches(axes: Axes, result: ModesResult, rpm: np.ndarray) -> None:
    """Draw each branch in pieces of one direction and one verdict, which share their ends."""
    for number in np.unique(result.branch[np.isfinite(result.branch)]):
        rows, places = np.nonzero(result.branch == number)
        direction = result.direction[rows, places]
        kind = np.where(direction > CLEAR, 1, np.where(direction < -CLEAR, -1, 0))
        verdict = result.stable[rows, places]
        breaks = np.flatnonzero((np.diff(kind) != 0) | (np.diff(verdict) != 0) | (np.diff(rows) > 1)) + 1
        for piece in np.split(np.arange(rows.size), breaks):
            last = piece[-1] + 1
            joined = last < rows.size and rows[last] == rows[last - 1] + 1
            shown = np.append(piece, last) if joined else piece
            colour = {1: style.RED, -1: BLUE, 0: style.BLACK}[int(kind[piece[0]])]
            y = result.frequency[rows[shown], places[shown]]
            line = LINES.get(int(verdict[piece[0]]), "-")
            axes.plot(rpm[rows[shown]], y, color=colour, linestyle=line, label=f"branch {number:.0f}")


def _excitation(axes: Axes, result: ModesResult, rpm: np.ndarray) -> None:
    speed, orders, frequency = result.critical
    for order in np.unique(orders):
        line = order * rpm / 60.0
        axes.plot(rpm, line, color=style.GREY, linewidth=0.6, linestyle=(0, (6, 3)), label=f"order {order:g}")
    axes.plot(speed * RPM, frequency, "o", markersize=2.5, color=style.BLACK, label="critical speeds")


def _legend(result: ModesResult) -> list[Line2D]:
    handles = [
        Line2D([], [], color=style.RED, label="forward"),
        Line2D([], [], color=BLUE, label="backward"),
        Line2D([], [], color=style.BLACK, label="neither"),
        Line2D([], [], color=style.BLACK, marker="o", markersize=2.5, linestyle="", label="critical"),
    ]
    for verdict, word in ((0, "unstable"), (-1, "undecided")):
        if (result.stable == verdict).any():
            handles.append(Line2D([], [], color=style.BLACK, linestyle=LINES[verdict], label=word))
    if np.isfinite(result.stability_limit):
        limit = f"stable up to {result.stability_limit * RPM:.0f} rpm"
        handles.append(Line2D([], [], color=style.RED, linewidth=0.8, linestyle="-.", label=limit))
    return handles
