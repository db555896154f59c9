"""The look that all pictures share: type, colours, ticks, heading and footer."""

import math
import textwrap
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib.style
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.text import Text
from matplotlib.ticker import LogFormatter, MaxNLocator, ScalarFormatter

from razy.plot.options import PlotOptions
from razy.read import DOWN, UP, ResultFile
from razy.read.extrema import MAXIMUM, MINIMUM, UNKNOWN

CM = 1 / 2.54
RASTER_ABOVE = 20_000
BLACK = "#000000"
GREY = "#8a8a8a"
RED = "#c1272d"
BLUE = "#1f5fa8"
EXTREMA = {MAXIMUM: ("maxima", GREY), MINIMUM: ("minima", BLACK), UNKNOWN: ("extrema", BLACK)}
DIRECTIONS = {UP: ("upwards", RED), DOWN: ("downwards", BLUE)}
EVENT_COLOURS = (RED, "#1f5fa8", "#2a8a4a", "#b8860b", "#7a4fa3", "#008b8b")

STYLE: dict[str, Any] = {
    # The first has no superscript but ¹²³.
    "font.family": ["STIXGeneral", "DejaVu Serif"],
    # Names and titles are a user's: "$" and backslashes in them are drawn as they are.
    "text.parse_math": False,
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.labelsize": 9.0,
    "axes.linewidth": 0.6,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "xtick.top": True,
    "ytick.right": True,
    "xtick.minor.visible": True,
    "ytick.minor.visible": True,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.minor.width": 0.4,
    "ytick.minor.width": 0.4,
    "xtick.major.size": 3.5,
    "ytick.major.size": 3.5,
    "xtick.minor.size": 1.8,
    "ytick.minor.size": 1.8,
    "legend.fontsize": 8.0,
    "legend.frameon": False,
    "legend.handletextpad": 0.3,
    "legend.columnspacing": 1.2,
    "lines.linewidth": 0.7,
    "agg.path.chunksize": 20000,
    "pdf.fonttype": 42,
}


@contextmanager
def look() -> Iterator[None]:
    """Return a context in which pictures are drawn and saved alike, whatever the user's settings of matplotlib.

    What is not finite is not drawn, and numpy's warnings say nothing to who draws.
    """
    with matplotlib.style.context(["default", STYLE]), np.errstate(all="ignore"):
        yield


def point_handle(label: str, colour: str) -> Line2D:
    """Return the legend's entry of points, larger than they are drawn."""
    return Line2D([], [], linestyle="none", marker="o", markersize=3.0, markeredgewidth=0.0, color=colour, label=label)


def marker_size(count: int) -> float:
    """Return the diameter of a point in pt, smaller the more there are: 2.2 up to 1e3 points, 0.45 from 1e6 on."""
    return float(np.interp(np.log10(max(count, 1)), (3.0, 4.0, 5.0, 6.0), (2.2, 1.4, 0.8, 0.45)))


def set_size(figure: Figure, options: PlotOptions, width: float, height: float) -> None:
    """Give the figure the size asked for, or `width` by `height` cm."""
    width, height = options.size or (width, height)
    figure.set_size_inches(width * CM, height * CM)
    figure.set_layout_engine("constrained", w_pad=0.04, h_pad=0.04, hspace=0.02, wspace=0.02)


def limits(low: float, high: float, margin: float) -> tuple[float, float]:
    """Return the ends of an axis: the range of the data and `margin` of its length at each end."""
    length = high - low
    if length <= 1e-12 * max(abs(low), abs(high)):
        length = abs(high) or 1.0
        return low - 0.05 * length, high + 0.05 * length
    return low - margin * length, high + margin * length


def set_axis(axis: Axis, low: float, high: float, space_cm: float | None = None) -> None:
    """Label an axis with plain numbers, never with an offset.

    Where `space_cm`, the length of a horizontal axis, is given, long numbers get fewer ticks.
    """
    formatter = ScalarFormatter(useOffset=False)
    formatter.set_scientific(False)
    axis.set_major_formatter(formatter)
    if space_cm is not None:
        digits = max(1, math.ceil(math.log10(max(abs(low), abs(high), 1.0)))) + 1
        digits += max(0, 1 - math.floor(math.log10((high - low) / 5)))
        most = max(2, min(9, int(space_cm / (0.17 * digits + 0.5))))
        axis.set_major_locator(MaxNLocator(most, steps=[1, 2, 2.5, 5, 10]))


def set_log_axis(axis: Axis) -> None:
    """Label a logarithmic axis without formulas, see "text.parse_math"."""
    axis.set_major_formatter(LogFormatter())
    axis.set_minor_formatter(LogFormatter(labelOnlyBase=False))


def title_of(result: ResultFile, options: PlotOptions) -> str:
    """Return the title asked for, else the one in the file, else the name of the file."""
    if options.title is not None:
        return options.title
    return result.title or Path(result.path).stem


def set_footer(figure: Figure, result: ResultFile, options: PlotOptions) -> None:
    """Write file, program, version and commit in small print below the picture, if asked for."""
    if options.footer:
        figure.supxlabel(provenance(result), x=0.99, ha="right", fontsize=5.5, color="0.45")


def provenance(result: ResultFile) -> str:
    """Return file, program, version and commit in one line."""
    version = f"razy {result.razy_version}".strip()
    commit = f" ({result.git_commit[:12]})" if result.git_commit else ""
    return f"{Path(result.path).name} · {result.program} · {version}{commit}"


def set_heading(figure: Figure, top: tuple[Axes, Axes], title: str, handles: list[Line2D]) -> None:
    """Write the title above the first axes, at its left end, and the legend above the second, at its right end.

    Where the two would meet, the title goes higher.
    """
    axes, right = top
    if not title:
        _legend(right, handles, alone=True)
        return
    figure.align_ylabels()
    # The title first: it is laid out with the legend.
    text = axes.set_title(title, loc="left", wrap=False)
    legend = _legend(right, handles, alone=False)
    if legend is None:
        lay_out(figure)
    _fold(text, title, figure.bbox.width * 0.98 - text.get_window_extent().x0)
    if legend is not None and text.get_window_extent().overlaps(legend.get_window_extent()):
        height = legend.get_window_extent().height * 72 / figure.dpi
        axes.set_title(text.get_text(), loc="left", pad=height + 4)
        # The title makes room for the legend below it.
        if figure.get_layout_engine() is not None:
            figure.get_layout_engine().set(rect=(0.0, 0.0, 1.0, 1.0))


def lay_out(figure: Figure) -> None:
    """Give all axes their places; drawing does it too, for three times as long."""
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.execute(figure)
    for axes in figure.axes:
        axes.apply_aspect()


def _legend(axes: Axes, handles: list[Line2D], alone: bool) -> Legend | None:
    """Write the legend above the axes in as many columns as fit the figure, in room taken from all axes alike.

    Where no title stands beside it (`alone`), that is no room of the title's.
    """
    if not handles:
        return None
    figure = axes.figure
    for columns in range(min(len(handles), 4), 0, -1):
        legend = axes.legend(
            handles=handles, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=columns, borderaxespad=0.15
        )
        legend.set_in_layout(False)
        lay_out(figure)
        if legend.get_window_extent().x0 >= 0.0:
            break
    engine = figure.get_layout_engine()
    if engine is not None and (alone or len(handles) > columns or len(figure.axes) > 1):
        engine.set(rect=(0.0, 0.0, 1.0, 1.0 - legend.get_window_extent().height / figure.bbox.height))
    return legend


def _fold(text: Text, title: str, width: float) -> None:
    """Break a title that is wider than `width` pixels into lines."""
    extent = text.get_window_extent().width
    if extent > width > 0:
        text.set_text("\n".join(textwrap.wrap(title, max(10, int(len(title) * width / extent)))))
