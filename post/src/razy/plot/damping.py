"""Damping ratios of the modes of a rotor over its speed."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from razy.errors import ResultError
from razy.plot import style
from razy.plot.campbell import BLUE, CLEAR, RPM
from razy.plot.labels import Room, write
from razy.plot.options import PlotOptions
from razy.read import ModesResult

# Damping ratios below this are those of a machine that nothing damps.
ROUNDING = 1e-10


def draw(result: ModesResult, figure: Figure, options: PlotOptions) -> None:
    """Draw the damping ratio of each branch over the speed, in the colour of its whirl; below 0 the motion grows."""
    if options.observables or options.coordinates:
        raise ResultError(f"{result.path}: a file of razy-modes holds no observables")
    if not result.is_campbell:
        raise ResultError(f"{result.path}: has no eigenvalues over the speed (&campbell)")
    style.set_size(figure, options, 16.0, 9.5)
    axes = figure.subplots()
    value = result.eigenvalue
    ratio = np.where(value.imag > 0, -value.real / np.abs(value), np.nan)
    ends = []
    for number in np.unique(result.branch[np.isfinite(result.branch)]):
        rows, places = np.nonzero(result.branch == number)
        direction = np.nanmean(result.direction[rows, places])
        colour = style.RED if direction > CLEAR else BLUE if direction < -CLEAR else style.BLACK
        axes.plot(result.speed[rows] * RPM, 100 * ratio[rows, places], color=colour, label=f"branch {number:.0f}")
        ends.append((rows[-1], places[-1]))
    if not np.nanmax(np.abs(ratio), initial=0.0) > ROUNDING:
        axes.set_ylim(-1.0, 1.0)
    axes.axhline(0.0, color=style.GREY, linewidth=0.6)
    axes.set_xlim(result.speed[0] * RPM if options.start is None else options.start,
                  result.speed[-1] * RPM if options.stop is None else options.stop)  # fmt: skip
    axes.set_xlabel("speed (rpm)")
    axes.set_ylabel("damping ratio (%)")
    kinds = (("forward", style.RED), ("backward", BLUE), ("neither", style.BLACK))
    style.set_footer(figure, result, options)
    style.set_heading(figure, (axes, axes), style.title_of(result, options),
                      [Line2D([], [], color=colour, label=word) for word, colour in kinds])  # fmt: skip
    style.lay_out(figure)
    at = [(result.speed[row] * RPM, 100 * ratio[row, place]) for row, place in ends if np.isfinite(ratio[row, place])]
    names = [f"{result.frequency[row, place]:.0f} Hz" for row, place in ends if np.isfinite(ratio[row, place])]
    room = Room(axes, [], [curve.get_data() for curve in axes.lines[:-1]])
    write(axes, [place for place in room.places(names, at) if place is not None])
