"""Short texts beside points of a diagram, none over another, over a mark or beyond the frame."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.text import Text
from numpy.typing import NDArray

SIZE = 6.5
MARK = 2.4
# Distances from the point to the nearest edge of the text, in pt; from the second on a thin line leads to the point.
DISTANCES = (3.5, 9.0, 15.0, 21.0)
DIRECTIONS = ((0, 1), (1, 1), (-1, 1), (1, 0), (-1, 0), (0, -1), (1, -1), (-1, -1))
LINE = {"arrowstyle": "-", "linewidth": 0.4, "color": "0.35", "shrinkA": 0.0, "shrinkB": 1.5}


@dataclass(frozen=True)
class Place:
    """A text, the point it belongs to (data), and its lower left corner from there (pt); `far`: with a line."""

    text: str
    at: tuple[float, float]
    offset: tuple[float, float]
    far: bool


class Room:
    """The room that marks and curves leave in axes whose limits and place are final.

    Parameters
    ----------
    axes
        Axes of a figure that was laid out.
    marks
        Points that no text may cover.
    curves
        Curves as (x, y) that texts rather do not cover.
    others
        Texts that no text may cover, drawn already.
    """

    def __init__(
        self,
        axes: Axes,
        marks: Sequence[tuple[float, float]],
        curves: Iterable[tuple[NDArray[np.float64], NDArray[np.float64]]],
        others: Iterable[Text] = (),
    ) -> None:
        figure = axes.figure
        self._axes = axes
        self._pt = figure.dpi / 72
        box = axes.get_window_extent()
        self._frame = np.array([box.x0, box.y0, box.x1, box.y1]) / self._pt
        self._marks = self._points(np.reshape(marks, (-1, 2)))
        self._ink = np.zeros((int(np.ceil(self._frame[3])) + 2, int(np.ceil(self._frame[2])) + 2), dtype=np.int32)
        extents = [text.get_window_extent().extents for text in others if text.get_visible() and text.get_text()]
        self._others = [extent / self._pt for extent in extents]
        for x, y in curves:
            self._trace(self._points(np.stack((x, y), axis=1)))

    def places(self, texts: Sequence[str], at: Sequence[tuple[float, float]]) -> list[Place | None]:
        """Return a place for each text beside its point, None where there is no room."""
        taken: list[NDArray[np.float64]] = list(self._others)
        found: list[Place | None] = []
        size = {text: self._size(text) for text in set(texts)}
        points = self._points(np.reshape(at, (-1, 2)))
        for text, point, data in zip(texts, points, at, strict=True):
            found.append(self._place(text, size[text], point, data, taken))
        return found

    def _place(self, text: str, size: NDArray, point: NDArray, data: tuple, taken: list[NDArray]) -> Place | None:
        best = None
        for far, distance in enumerate(DISTANCES):
            for direction in DIRECTIONS:
                centre = point + np.asarray(direction) * (0.5 * size + distance / np.hypot(*direction))
                box = np.concatenate((centre - 0.5 * size, centre + 0.5 * size))
                if not self._free(box, taken):
                    continue
                covered = self._covered(box)
                if best is None or covered < best[0]:
                    best = covered, box, bool(far)
            if best is not None and best[0] == 0:
                break
        if best is None:
            return None
        taken.append(best[1])
        return Place(text, (float(data[0]), float(data[1])), tuple(best[1][:2] - point), best[2])

    def _free(self, box: NDArray, taken: list[NDArray]) -> bool:
        inside = np.all(box[:2] > self._frame[:2] + 2.0) and np.all(box[2:] < self._frame[2:] - 2.0)
        if not inside or np.any(np.all((self._marks > box[:2] - MARK) & (self._marks < box[2:] + MARK), axis=1)):
            return False
        return not any(np.all(box[:2] < other[2:] + 1.0) and np.all(other[:2] < box[2:] + 1.0) for other in taken)

    def _covered(self, box: NDArray) -> int:
        left, low, right, high = np.rint(box).astype(int)
        return int(np.count_nonzero(self._ink[low:high, left:right]))

    def _trace(self, points: NDArray) -> None:
        """Enter a curve into the ink, a point of print wide."""
        for start, stop in pairwise(points):
            if not (np.all(np.isfinite(start)) and np.all(np.isfinite(stop))):
                continue
            steps = np.linspace(0.0, 1.0, min(int(np.abs(stop - start).max()) + 2, 2000))
            column, row = np.rint(start[:, None] + (stop - start)[:, None] * steps).astype(int)
            inside = (row >= 0) & (row < self._ink.shape[0]) & (column >= 0) & (column < self._ink.shape[1])
            self._ink[row[inside], column[inside]] = 1

    def _points(self, data: NDArray) -> NDArray:
        return self._axes.transData.transform(data) / self._pt

    def _size(self, text: str) -> NDArray:
        item = self._axes.text(0.0, 0.0, text, fontsize=SIZE)
        box = item.get_window_extent()
        item.remove()
        return np.array([box.width, 0.8 * box.height]) / self._pt


def write(axes: Axes, places: Iterable[Place]) -> None:
    """Write the texts at their places."""
    for place in places:
        note = axes.annotate(
            place.text,
            place.at,
            xytext=place.offset,
            textcoords="offset points",
            fontsize=SIZE,
            arrowprops=LINE if place.far else None,
            zorder=4.0,
        )
        note.set_in_layout(False)
