"""Colours for the period of a motion, in periods of the excitation."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.patches import Patch
from numpy.typing import NDArray

CLASSES = (
    ("1", "#d9e4ec"),
    ("2", "#7fb2d6"),
    ("3", "#2a8a4a"),
    ("4", "#1f5fa8"),
    ("5 to 8", "#b8860b"),
    ("9 to 32", "#e0a060"),
    ("not periodic", "#c1272d"),
    ("not determined", "#ffffff"),
    ("not settled", "#b0b0b0"),
)
COLOURS = ListedColormap([colour for _, colour in CLASSES])
NORM = BoundaryNorm(np.arange(len(CLASSES) + 1) - 0.5, len(CLASSES))


def classes_of(period: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the index into `CLASSES` of each period; 0 is not periodic, -1 not determined, -2 not settled."""
    index = np.searchsorted([1, 2, 3, 4, 8, 32], period, side="left")
    index = np.where(period == 0, 6, index)
    return np.where(period < 0, np.where(period == -2, 8, 7), index)


def legend(axes: Axes, classes: NDArray[np.int64]) -> None:
    """Explain the colours that occur, below the axes."""
    handles = [Patch(facecolor=CLASSES[i][1], edgecolor="0.6", linewidth=0.4, label=CLASSES[i][0]) for i in classes]
    axes.figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), title="period of the motion")


def band(axes: Axes, ways: list[tuple[str, NDArray[np.float64], NDArray[np.int64]]]) -> None:
    """Fill axes with the colour of the period of each point, from half way to half way to its neighbours.

    Parameters
    ----------
    axes
        Axes, low and wide.
    ways
        Words, parameter and period of the points of each way, the first at the top.
    """
    found = [_stripe(axes, len(ways) - 1 - row, at, period) for row, (_, at, period) in enumerate(ways)]
    axes.set_ylim(0.0, float(len(ways)))
    axes.set_yticks([])
    axes.minorticks_off()
    words = "\n".join(name for name, _, _ in ways)
    axes.set_ylabel(words, rotation=0, ha="right", va="center", fontsize=7.5)
    legend(axes, np.unique(np.concatenate(found)))


def _stripe(axes: Axes, low: float, at: NDArray[np.float64], period: NDArray[np.int64]) -> NDArray[np.int64]:
    order = np.argsort(at, kind="stable")
    at, classes = at[order], classes_of(period[order])
    middle = 0.5 * (at[1:] + at[:-1])
    half = 0.5 * float(np.median(np.diff(at))) if at.size > 1 else 0.5
    edges = np.concatenate(([at[0] - half], middle, [at[-1] + half]))
    axes.pcolormesh(edges, [low, low + 1.0], classes[None, :], cmap=COLOURS, norm=NORM, rasterized=True)
    return classes
