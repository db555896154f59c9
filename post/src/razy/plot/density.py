"""Density images for more points than can be drawn one by one; memory does not grow with their number."""

from collections.abc import Iterable

import matplotlib.colors
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from razy.plot import style

CELL_POINTS = 0.45
FAINTEST = 0.35

Part = tuple[NDArray[np.float64], NDArray[np.float64]]


class Density:
    """Counts of points in the cells of a regular grid.

    Parameters
    ----------
    x_range, y_range
        Ends of the grid, low before high, in the units of the points; points outside are not counted.
    shape
        Number of cells in y and x.
    """

    def __init__(self, x_range: tuple[float, float], y_range: tuple[float, float], shape: tuple[int, int]) -> None:
        self.x_range = x_range
        self.y_range = y_range
        self.shape = shape
        self.counts = np.zeros(shape, dtype=np.int64)

    def add(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> None:
        """Count points; `x` and `y` have shape (points,)."""
        rows, columns = self.shape
        row = _cell(y, self.y_range, rows)
        column = _cell(x, self.x_range, columns)
        inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
        flat = row[inside] * columns + column[inside]
        self.counts += np.bincount(flat, minlength=rows * columns).reshape(self.shape)

    def image(self, colour: str, weight: NDArray[np.float64] | None = None) -> NDArray[np.float32]:
        """Return the picture of the counts, shape (rows, columns, 4): `colour`, opaque where points are dense.

        Opacity grows with the logarithm of the density, from a floor that keeps a single point visible.

        Parameters
        ----------
        colour
            Any colour that matplotlib knows.
        weight
            Shape (columns,); counts are divided by it, so that columns that hold more motions are not darker.
        """
        density = self.counts.astype(np.float64)
        if weight is not None:
            density /= np.maximum(weight, 1.0)
        hit = density > 0.0
        image = np.zeros((*self.shape, 4), dtype=np.float32)
        image[..., :3] = matplotlib.colors.to_rgb(colour)
        if np.any(hit):
            level = np.log(density[hit])
            low, high = level.min(), np.percentile(level, 98)
            span = high - low
            relative = np.clip((level - low) / span, 0.0, 1.0) if span > 0.0 else np.ones_like(level)
            image[hit, 3] = FAINTEST + (1.0 - FAINTEST) * relative
        return image


def fill(density: Density, parts: Iterable[Part]) -> Density:
    """Count the points of all parts; non-finite ones are left out."""
    for x, y in parts:
        keep = np.isfinite(x) & np.isfinite(y)
        density.add(x[keep], y[keep])
    return density


def bounds(parts: Iterable[Part]) -> tuple[tuple[float, float], tuple[float, float]] | None:
    """Return the smallest and largest finite x and y of all parts; None if there is no finite point."""
    low, high = np.full(2, np.inf), np.full(2, -np.inf)
    for part in parts:
        values = np.stack(part)
        values = values[:, np.all(np.isfinite(values), axis=0)]
        if values.size:
            low, high = np.minimum(low, values.min(axis=1)), np.maximum(high, values.max(axis=1))
    if not np.all(low <= high):
        return None
    return (float(low[0]), float(high[0])), (float(low[1]), float(high[1]))


def cells(figure: Figure, axes: Axes) -> tuple[int, int]:
    """Return the number of cells in y and x that axes hold at a cell of about `CELL_POINTS` points.

    Limits and labels of the axes must be final.
    """
    style.lay_out(figure)
    box = axes.get_window_extent()
    pixels = max(1, round(CELL_POINTS * figure.dpi / 72))
    return max(1, round(box.height / pixels)), max(1, round(box.width / pixels))


def show(axes: Axes, density: Density, image: NDArray[np.float32]) -> None:
    """Put an image of `density` into axes without changing their limits."""
    view = axes.get_xlim(), axes.get_ylim()
    extent = (*density.x_range, *density.y_range)
    axes.imshow(image, extent=extent, origin="lower", aspect="auto", interpolation="none")
    axes.set(xlim=view[0], ylim=view[1])


def _cell(values: NDArray[np.float64], ends: tuple[float, float], count: int) -> NDArray[np.int64]:
    """Return the cell of each value; one on the upper end belongs to the last cell."""
    low, high = ends
    index = np.floor((values - low) * (count / (high - low))).astype(np.int64)
    index[values == high] = count - 1
    return index
