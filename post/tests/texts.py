"""The texts of a figure as they are drawn: which leave it, which lie over one another."""

from itertools import combinations
from unittest.mock import patch

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

# Boxes of texts hold some room below and above the letters.
SLACK = 1.5


def boxes(figure: Figure) -> list[tuple[str, np.ndarray]]:
    """Return the texts that are drawn with the corners of their boxes (4, 2), in pixels."""
    found = []
    draw = Text.draw

    def note(text: Text, renderer) -> None:
        draw(text, renderer)
        if text.get_visible() and text.get_text().strip():
            angle = text.get_rotation()
            middle = Text.get_window_extent(text, renderer)
            middle = np.array([middle.x0 + middle.x1, middle.y0 + middle.y1]) / 2
            text.set_rotation(0.0)
            level = Text.get_window_extent(text, renderer)
            text.set_rotation(angle)
            half = np.array([level.width, level.height]) / 2 - SLACK
            turn = np.radians(angle)
            axes = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
            signs = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
            found.append((text.get_text(), middle + (signs * np.maximum(half, 0.0)) @ axes))

    with patch.object(Text, "draw", note):
        FigureCanvasAgg(figure).draw()
    return found


def apart(one: np.ndarray, other: np.ndarray) -> bool:
    """Return whether a side of one of two rectangles parts them."""
    for side in (one[1] - one[0], one[3] - one[0], other[1] - other[0], other[3] - other[0]):
        a, b = one @ side, other @ side
        if a.max() <= b.min() or b.max() <= a.min():
            return True
    return False


def misplaced(figure: Figure, found: list[tuple[str, np.ndarray]] | None = None) -> list[str]:
    """Return which texts leave the figure, and which pairs lie over one another; `found` are its boxes, if known."""
    found = boxes(figure) if found is None else found
    edge = np.array([figure.bbox.width, figure.bbox.height])
    said = [f"'{text}' leaves" for text, box in found if box.min() < -SLACK or np.any(box > edge + SLACK)]
    for (text, box), (other, its) in combinations(found, 2):
        if not apart(box, its):
            said.append(f"'{text}' over '{other}'")
    return said
