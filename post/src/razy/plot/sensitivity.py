"""How far the special points of branches move where values of the machine grow by one per cent: bars."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from razy.errors import ResultError
from razy.plot import style
from razy.plot.branches import MARKS
from razy.plot.options import PlotOptions
from razy.plot.units import readable_name, scale_for
from razy.read import FollowResult, Special

PER_CENT = 0.01
# Height of a bar, of the room between two points, and of all else, cm; more points than this nobody reads.
BAR, GAP, FRAME = 0.28, 0.3, 2.4
MOST_POINTS = 40


def draw(result: FollowResult, figure: Figure, options: PlotOptions) -> None:
    """Draw a group of bars for each special point in the range asked for, one for each value."""
    if options.observables or options.coordinates:
        raise ResultError(f"{result.path}: sensitivities have no observables")
    found = result.sensitivities
    if found is None:
        raise ResultError(f"{result.path}: holds no sensitivities; they need &follow sensitivities=")
    special, quantity = result.special, result.parameter()
    low = -np.inf if options.start is None else options.start
    high = np.inf if options.stop is None else options.stop
    at = special.parameter[found.special]
    shown = np.flatnonzero((at >= low) & (at <= high) & np.isfinite(found.slope).any(axis=0))
    if shown.size == 0:
        raise ResultError(f"{result.path}: no special point with a sensitivity {options.range_text()}".rstrip())
    if shown.size > MOST_POINTS:
        raise ResultError(
            f"{result.path}: {shown.size} special points are more than {MOST_POINTS}, which a picture shows; "
            "choose with --from and --to"
        )
    moves = PER_CENT * found.slope[:, shown] * found.values[:, None]
    scale = scale_for(quantity.units, float(np.nanmax(np.abs(moves))))
    count = found.names.size
    pitch = count * BAR + GAP
    style.set_size(figure, options, 16.0, FRAME + pitch * shown.size)
    style.set_footer(figure, result, options)
    axes = figure.subplots()
    handles = []
    for number, (name, values) in enumerate(zip(found.names, moves, strict=True)):
        colour = style.EVENT_COLOURS[number % len(style.EVENT_COLOURS)]
        places = np.arange(shown.size) * pitch + number * BAR
        axes.barh(places, values * scale.factor, height=0.85 * BAR, color=colour, label=name, align="edge")
        handles.append(Line2D([], [], color=colour, linewidth=3.0, label=name))
    axes.axvline(0.0, color=style.BLACK, linewidth=0.5)
    axes.set_yticks(np.arange(shown.size) * pitch + 0.5 * count * BAR)
    axes.set_yticklabels([_name(special, row) for row in found.special[shown]])
    axes.invert_yaxis()
    unit = f" ({scale.unit})" if scale.unit else ""
    axes.set_xlabel(f"change of {readable_name(quantity)} for +1 %{unit}")
    style.set_heading(figure, (axes, axes), style.title_of(result, options), handles)


def _name(special: Special, row: int) -> str:
    label = str(special.label[row])
    return f"{MARKS[label][0]} at {special.parameter[row]:.8g}, branch {special.branch[row]}"
