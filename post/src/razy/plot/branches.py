"""Branches of periodic motions over a parameter: stable full, unstable dashed, undecided dotted, special points marked.

What stands on the vertical axis is chosen by ``quantity``: the extrema of an observable over one period, the largest
or the smallest of them, or the absolute value of the largest Floquet multiplier. Points of a sweep may lie below.
Where all motions were looked for, the largest Lyapunov exponent of the machine's own motion stands beneath.
"""

import warnings
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from razy.errors import ResultError
from razy.plot import labels, style
from razy.plot.bifurcation import LYAPUNOV_HEIGHT, draw_exponents, observables_of
from razy.plot.options import PlotNote, PlotOptions
from razy.plot.units import LABEL_WIDTH, Scale, axis_label, scale_for
from razy.read import Extrema, ExtremaFile, FollowResult, Quantity, SweepResult

COLOURS = {1: style.BLACK, 2: "#1f5fa8", 3: "#2a8a4a", 4: style.RED}
MORE_COLOURS = ("#b8860b", "#7a4fa3", "#008b8b")
PALE = "#b4b4b4"
PROVED = {"color": "#bfe3bf", "linewidth": 3.2, "solid_capstyle": "butt", "zorder": 1.5}
DASHED = (0, (3.4, 1.8))
# As in the file: whether a motion is stable, and undecided where the error of a multiplier covers the unit circle.
STABLE, UNSTABLE, UNDECIDED = 1, 0, -1
LINES = {STABLE: "-", UNSTABLE: DASHED, UNDECIDED: (0, (0.8, 1.2))}
WORDS = {STABLE: "stable", UNSTABLE: "unstable", UNDECIDED: "undecided"}

# Marker, size, filled; those with a name in the picture come first.
NAMED = ("LP", "PD", "TR", "BP", "HB")
MARKS = {
    "LP": ("fold", "o", 3.2, True),
    "PD": ("period doubling", "D", 3.2, False),
    "TR": ("torus", "^", 3.8, False),
    "BP": ("branch point", "s", 3.4, False),
    "HB": ("Hopf point", "*", 5.0, True),
    "GR": ("grazing", "|", 4.0, True),
    "CH": ("change of contacts", "x", 2.6, True),
    "ST": ("sticking begins or ends", "1", 4.0, True),
    "SL": ("sliding begins or ends", "2", 4.0, True),
}
# Bounds within which an extremum of the next motion goes on from one of this: part of a period, part of the picture.
NEAR_PHASE, NEAR_VALUE = 0.15, 0.35
# More labels than these nobody reads.
MOST_LABELS = 30
# Multipliers at a located point are on the unit circle to this.
ON_CIRCLE = 1e-5


@dataclass(frozen=True)
class Panel:
    """What one pair of axes shows.

    Attributes
    ----------
    label
        Text of the vertical axis.
    curves
        Pieces of branches, each as (motions, values); values in the unit of the axis, shape (points,) both.
    top
        Where a special point of a motion is marked, shape (motions,), NaN where the motion has none.
    below
        Points of the sweep, as parameter and value.
    """

    label: str
    curves: list[tuple[NDArray[np.int64], NDArray[np.float64]]]
    top: NDArray[np.float64]
    below: tuple[NDArray[np.float64], NDArray[np.float64]]


def draw(result: FollowResult, figure: Figure, options: PlotOptions) -> None:
    """Draw the branches, for each observable asked for one panel above the other."""
    if options.coordinates:
        raise ResultError(f"{result.path}: branches hold extrema of observables, no coordinates")
    # A case that records no extrema has multipliers all the same.
    extrema = result.observables or options.observables or options.sweep is not None
    chosen = options.quantity or ("extrema" if extrema else "multiplier")
    if chosen == "multiplier" and (options.observables or options.sweep is not None):
        raise ResultError(f"{result.path}: multipliers belong to no observable, and a sweep has none")
    names = (None,) if chosen == "multiplier" else observables_of(result, options)
    _check_sweep(result, options.sweep)
    parameter = result.grid()
    selected = _selected(result, parameter, options)
    quantity = result.parameter()
    x_scale = scale_for(quantity.units, float(np.abs(parameter[selected]).max()))
    x = parameter * x_scale.factor
    ends = (x.min() if options.start is None else max(options.start * x_scale.factor, x.min()), x.max())
    ends = (ends[0], ends[1] if options.stop is None else min(options.stop * x_scale.factor, ends[1]))
    x_limits = style.limits(*ends, 0.01)

    style.set_size(figure, options, 16.0, 9.5 if len(names) == 1 else 5.0 * len(names) + 1.5)
    style.set_footer(figure, result, options)
    samples = result.samples
    ratios = [1.0] * len(names) + ([LYAPUNOV_HEIGHT * len(names)] if samples is not None else [])
    column = figure.subplots(len(ratios), 1, sharex=True, squeeze=False, height_ratios=ratios)[:, 0]
    column[-1].set_xlabel(axis_label(quantity, x_scale))
    style.set_axis(column[-1].xaxis, *x_limits, space_cm=figure.get_figwidth() / style.CM - 2.0)
    column[-1].set_xlim(x_limits)
    if samples is not None:
        draw_exponents(column[-1], samples.parameter * x_scale.factor, samples.lyapunov[:, None])
        column = column[:-1]
    width = LABEL_WIDTH * (2 if len(names) == 1 else 1)
    panels = [_panel(result, options, name, chosen, selected, width) for name in names]
    stable = _stable_pieces(result)
    for axes, panel in zip(column, panels, strict=True):
        _draw_panel(axes, result, panel, x, x_scale.factor, selected, stable)
        if options.proved is not None:
            _underline(axes, panel, x, selected & options.proved)
    special = _Specials(result, selected)
    handles = [Line2D([], [], label="proved", **PROVED)] if options.proved is not None else []
    handles += _handles(result, panels, selected, stable, special)
    for axes, panel in zip(column, panels, strict=True):
        special.mark(axes, x, panel.top)
    style.set_heading(figure, (column[0], column[0]), style.title_of(result, options), handles)
    missing = sum(special.write(axes, x, panel) for axes, panel in zip(column, panels, strict=True))
    if missing:
        warnings.warn(
            f"no room for the labels of {missing} points; --from and --to draw a part of the range",
            PlotNote,
            stacklevel=2,
        )


def _check_sweep(result: FollowResult, sweep: SweepResult | None) -> None:
    if sweep is not None and sweep.parameters != result.parameters:
        raise ResultError(
            f"{sweep.path}: sweeps over {' and '.join(sweep.parameters)}; the branches of {result.path} are over "
            f"{result.parameters[0]}"
        )


def _selected(result: FollowResult, parameter: NDArray[np.float64], options: PlotOptions) -> NDArray[np.bool_]:
    selected = np.isfinite(parameter)
    selected &= parameter >= options.start if options.start is not None else True
    selected &= parameter <= options.stop if options.stop is not None else True
    if not np.any(selected):
        has = f"the file has {parameter.min():g} to {parameter.max():g}" if parameter.size else "the file has none"
        raise ResultError(f"{result.path}: no motion of {result.parameters[0]} {options.range_text()} ({has})")
    return selected


def _panel(
    result: FollowResult,
    options: PlotOptions,
    name: str | None,
    chosen: str,
    selected: NDArray[np.bool_],
    label_width: int,
) -> Panel:
    """Read what one panel shows."""
    nothing = np.zeros(0)
    if name is None:
        value = result.largest_multiplier
        return Panel("largest |multiplier|", list(_pieces(result, value)), value, (nothing, nothing))
    extrema = result.extrema(name)
    read = extrema.all()
    motion = np.repeat(np.arange(result.n_points), extrema.counts)
    shown = read.value[selected[motion] & np.isfinite(read.value)]
    if shown.size == 0:
        raise ResultError(f"{result.path}: no extrema of '{name}' {options.range_text()}")
    scale = scale_for(extrema.quantity.units, float(np.abs(shown).max()))
    read = Extrema(read.value * scale.factor, read.time, read.kind)
    top, bottom = (_of_each(sense, motion, read.value, result.n_points) for sense in (np.fmax, np.fmin))
    if chosen == "largest":
        curves = list(_pieces(result, top))
    elif chosen == "smallest":
        curves, top = list(_pieces(result, bottom)), bottom
    else:
        curves = list(_followed(result, read, extrema.offset, float(np.ptp(shown)) * scale.factor))
    quantity = extrema.quantity
    if chosen != "extrema":
        quantity = Quantity(quantity.name, quantity.units, f"{chosen} {quantity.long_name}")
    below = (nothing, nothing) if options.sweep is None else _below(options.sweep, name, chosen, scale)
    return Panel(axis_label(quantity, scale, label_width), curves, top, below)


def _of_each(sense: np.ufunc, motion: NDArray[np.int64], value: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Return the largest (or smallest) value of each motion, NaN where it has none, shape (count,)."""
    found = np.full(count, np.nan)
    sense.at(found, motion, value)
    return found


def _below(sweep: ExtremaFile, name: str, chosen: str, scale: Scale) -> tuple[NDArray, NDArray]:
    extrema = sweep.extrema(name)
    value = extrema.all().value * scale.factor
    point = np.repeat(np.arange(sweep.n_points), extrema.counts)
    grid = sweep.grid()
    if chosen == "extrema":
        return grid[point], value
    return grid, _of_each(np.fmax if chosen == "largest" else np.fmin, point, value, sweep.n_points)


def _pieces(result: FollowResult, value: NDArray[np.float64]) -> Iterator[tuple[NDArray, NDArray]]:
    """Return the curve of one value of each motion, a piece for each branch."""
    for rows in np.split(np.arange(result.n_points), np.flatnonzero(np.diff(result.branch)) + 1):
        yield rows, value[rows]


def _followed(
    result: FollowResult, read: Extrema, offset: NDArray[np.int64], span: float
) -> Iterator[tuple[NDArray, NDArray]]:
    """Follow each extremum from motion to motion; where one appears or vanishes, its curve begins or ends."""
    multiplicity = result.multiplicity
    period = result.column("period")
    branch = result.branch
    open_curves: list[list[tuple[int, int]]] = []
    before: tuple = ()
    for row in range(result.n_points):
        part = slice(int(offset[row]), int(offset[row + 1]))
        phase = np.mod(read.time[part] * (multiplicity[row] / period[row]), multiplicity[row])
        here = (phase, read.value[part], read.kind[part])
        curves: list[list[tuple[int, int]] | None] = [None] * phase.size
        if row > 0 and branch[row] == branch[row - 1]:
            for old, new in _matches(before, here, multiplicity[row], span or 1.0):
                curves[new] = open_curves[old]
        for number, curve in enumerate(curves):
            curves[number] = curve if curve is not None else []
            curves[number].append((row, part.start + number))
        ended = [curve for curve in open_curves if not any(curve is other for other in curves)]
        yield from (_as_arrays(curve, read.value) for curve in ended)
        open_curves, before = curves, here
    yield from (_as_arrays(curve, read.value) for curve in open_curves)


def _as_arrays(curve: list[tuple[int, int]], value: NDArray[np.float64]) -> tuple[NDArray, NDArray]:
    rows, places = np.asarray(curve, dtype=np.int64).T
    return rows, value[places]


def _matches(before: tuple, here: tuple, multiplicity: int, span: float) -> Iterator[tuple[int, int]]:
    """Return pairs of extrema of two neighbouring motions, the nearest first, each in at most one pair."""
    apart = np.mod(here[0][None, :] - before[0][:, None] + 0.5 * multiplicity, multiplicity) - 0.5 * multiplicity
    apart = np.abs(apart) / NEAR_PHASE
    step = np.abs(here[1][None, :] - before[1][:, None]) / (NEAR_VALUE * span)
    distance = np.where(before[2][:, None] == here[2][None, :], np.maximum(apart, step), np.inf)
    order = np.argsort(apart + step, axis=None, kind="stable")
    old_free, new_free = np.ones(distance.shape[0], dtype=bool), np.ones(distance.shape[1], dtype=bool)
    for old, new in zip(*np.unravel_index(order, distance.shape), strict=True):
        if old_free[old] and new_free[new] and distance[old, new] <= 1.0:
            old_free[old] = new_free[new] = False
            yield int(old), int(new)


def _stable_pieces(result: FollowResult) -> NDArray[np.int32]:
    """Return whether the branch is stable from each motion to the next, as in the file, shape (motions,).

    At a located point a multiplier is on the unit circle, so the motion beside it decides.
    """
    kind = result.labels
    located = np.isin(kind, NAMED)
    stable = result.column("stable")
    after_change = np.isin(np.append(kind[1:], ""), ("GR", "CH", "ST", "SL"))
    next_stable = np.append(stable[1:], UNSTABLE)
    next_counts = ~np.append(located[1:], True) & ~after_change
    weakly = result.largest_multiplier < 1.0 + ON_CIRCLE
    between = np.where(weakly & np.append(weakly[1:], True), STABLE, UNSTABLE)
    return np.where(~located, stable, np.where(next_counts, next_stable, between))


def _draw_panel(
    axes: Axes,
    result: FollowResult,
    panel: Panel,
    x: NDArray[np.float64],
    factor: float,
    selected: NDArray[np.bool_],
    stable: NDArray[np.int32],
) -> None:
    """Draw points of the sweep, which show around curves they lie on, then curves, one line for each kind of them."""
    at, value = panel.below[0] * factor, panel.below[1]
    low, high = axes.get_xlim()
    keep = np.isfinite(value) & (at >= low) & (at <= high)
    axes.plot(
        at[keep],
        value[keep],
        linestyle="none",
        marker="o",
        markersize=1.4 * style.marker_size(int(keep.sum())),
        markeredgewidth=0.0,
        color=PALE,
        label="sweep",
        rasterized=keep.sum() > style.RASTER_ABOVE,
        zorder=1.0,
    )
    multiplicity = result.multiplicity
    parts: dict[tuple[int, int], list[NDArray[np.float64]]] = {}
    ends = [value[keep]]
    for rows, values in panel.curves:
        ends.append(values[selected[rows] & np.isfinite(values)])
        for piece in np.split(np.arange(rows.size), np.flatnonzero(np.diff(stable[rows[:-1]])) + 1):
            last = min(piece[-1] + 2, rows.size)
            shown = np.arange(piece[0], last)
            if not np.any(selected[rows[shown]]):
                continue
            kind = (int(multiplicity[rows[piece[0]]]), int(stable[rows[piece[0]]]))
            curve = np.stack((x[rows[shown]], values[shown]))
            parts.setdefault(kind, []).append(np.append(curve, np.full((2, 1), np.nan), axis=1))
    for (period, sort), pieces in sorted(parts.items(), reverse=True):
        axes.plot(
            *np.concatenate(pieces, axis=1)[:, :-1],
            color=_colour(period),
            linewidth=0.9,
            linestyle=LINES[sort],
            dash_capstyle="butt",
            label=f"period {period}, {WORDS[sort]}",
            zorder=2.5 - 0.01 * period,
        )
    shown = np.concatenate(ends)
    y_limits = style.limits(float(shown.min()), float(shown.max()), 0.08)
    axes.set_ylabel(panel.label)
    style.set_axis(axes.yaxis, *y_limits)
    axes.set_ylim(y_limits)


def _underline(axes: Axes, panel: Panel, x: NDArray[np.float64], proved: NDArray[np.bool_]) -> None:
    """Draw a pale line beneath all motions that are proved."""
    for rows, values in panel.curves:
        axes.plot(x[rows], np.where(proved[rows], values, np.nan), label="proved", **PROVED)


def _colour(period: int) -> str:
    return COLOURS.get(period) or MORE_COLOURS[(period - 5) % len(MORE_COLOURS)]


def _handles(
    result: FollowResult,
    panels: list[Panel],
    selected: NDArray[np.bool_],
    stable: NDArray[np.int32],
    special: "_Specials",
) -> list[Line2D]:
    """Return the entries of the legend."""
    periods = np.unique(result.multiplicity[selected])
    handles = [Line2D([], [], color=_colour(int(n)), linewidth=0.9, label=f"period {n}") for n in periods]
    handles += [
        Line2D([], [], color=style.GREY, linewidth=0.9, linestyle=LINES[kind], label=WORDS[kind])
        for kind in (UNSTABLE, UNDECIDED)
        if np.any(stable[selected] == kind)
    ]
    if any(panel.below[0].size for panel in panels):
        handles.append(style.point_handle("sweep", PALE))
    return handles + special.handles()


class _Specials:
    """The special points in the range, each once; of those that several branches share, that of the shortest period."""

    def __init__(self, result: FollowResult, selected: NDArray[np.bool_]) -> None:
        special = result.special
        keep = np.isin(special.label, tuple(MARKS)) & selected[special.point]
        order = np.argsort(result.multiplicity[special.point[keep]], kind="stable")
        self.label = special.label[keep][order]
        self.row = special.point[keep][order]

    def handles(self) -> list[Line2D]:
        """Return an entry of the legend for each kind that occurs."""
        return [
            Line2D([], [], linestyle="none", label=f"{label} {MARKS[label][0]}", **_mark(label))
            for label in MARKS
            if label in self.label
        ]

    def mark(self, axes: Axes, x: NDArray[np.float64], y: NDArray[np.float64]) -> None:
        """Draw the marks; y has the height at each motion."""
        for label in MARKS:
            rows = self._rows(axes, x, y, label)
            if rows.size:
                above = 3.2 if label in NAMED else 3.0
                axes.plot(x[rows], y[rows], linestyle="none", label=label, zorder=above, **_mark(label))

    def write(self, axes: Axes, x: NDArray[np.float64], panel: Panel) -> int:
        """Write labels where there is room, with the parameter if all have room; return how many have none."""
        named = [(label, row) for label in NAMED for row in self._rows(axes, x, panel.top, label)]
        if len(named) > MOST_LABELS:
            return len(named)
        at = [(x[row], panel.top[row]) for _, row in named]
        marks = [(x[row], panel.top[row]) for label in MARKS for row in self._rows(axes, x, panel.top, label)]
        curves = [(x[rows], values) for rows, values in panel.curves]
        room = labels.Room(axes, marks, curves)
        full = room.places([f"{label} {x[row]:.6g}" for label, row in named], at)
        if all(place is not None for place in full):
            labels.write(axes, full)
            return 0
        short = room.places([label for label, _ in named], at)
        labels.write(axes, [place for place in short if place is not None])
        return sum(place is None for place in short)

    def _rows(self, axes: Axes, x: NDArray, y: NDArray, label: str) -> NDArray[np.int64]:
        """Return the motions of the points of a kind, without those that lie on another to half a point of print."""
        rows = self.row[(self.label == label) & np.isfinite(y[self.row])]
        width, height = axes.figure.get_size_inches() * 144
        (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
        cell = np.stack((x[rows] * width / (right - left), y[rows] * height / (high - low))).round()
        return rows[np.sort(np.unique(cell, axis=1, return_index=True)[1])]


def _mark(label: str) -> dict:
    _, marker, size, filled = MARKS[label]
    return {
        "marker": marker,
        "markersize": size,
        "color": style.BLACK,
        "markerfacecolor": style.BLACK if filled else "white",
        "markeredgewidth": 0.7,
    }
