"""Look at a figure as a picture, and at what was plotted into it."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from razy.plot import PlotOptions, draw
from razy.read import open_result


def drawn(path, kind=None, dpi=100, **options) -> Figure:
    """Return the finished figure of a file."""
    figure = Figure(dpi=dpi)
    with open_result(path) as result:
        draw(result, figure, PlotOptions(**options), kind)
    return figure


def pixels(figure: Figure) -> np.ndarray:
    """Return the picture, shape (rows, columns, 3), 0 black to 255 white."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].astype(int)


def inside(figure: Figure, axes: Axes) -> np.ndarray:
    """Return the part of the picture within the frame of the axes, without the ticks."""
    picture = pixels(figure)
    box = axes.get_window_extent()
    top = picture.shape[0]
    return picture[top - int(box.y1) + 14 : top - int(box.y0) - 14, int(box.x0) + 14 : int(box.x1) - 14]


def near(marked: np.ndarray) -> np.ndarray:
    """Return which pixels are at most three rows and columns from a marked one."""
    rows, columns = marked.shape
    wide = np.pad(marked, 3)
    return np.any([wide[i : i + rows, j : j + columns] for i in range(7) for j in range(7)], axis=0)


def line(axes: Axes, label: str):
    """Return the data of the line with this label."""
    found = [item for item in axes.get_lines() if item.get_label() == label]
    assert len(found) == 1, [item.get_label() for item in axes.get_lines()]
    return np.asarray(found[0].get_xdata(), dtype=float), np.asarray(found[0].get_ydata(), dtype=float)
