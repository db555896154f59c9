"""Contact events as marks on time histories."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from razy.plot import style
from razy.read import RunResult
from razy.read.file import branch_of

MOST_MARKERS = 200
MOST_LARGE_MARKERS = 40
MOST_GROUPS = 6

# Markers of the branches that a contact enters, by what the file calls them; any other is a filled circle.
MARKERS = {
    "closed (upper side)": "^",
    "closed (lower side)": "v",
    "parting (upper side)": "D",
    "parting (lower side)": "d",
    "sliding forward": ">",
    "sliding backward": "<",
    "sticking": "s",
}
OPEN = "open"
# A rigid stop enters `open` again and again: it is closed only while it rests.
OPEN_AGAIN = "impact or lift-off"


@dataclass(frozen=True)
class Marks:
    """Events drawn alike.

    Attributes
    ----------
    time
        Times in s, shape (events,).
    marker
        Shape of the marker, one for each branch.
    filled
        Whether the marker is filled; one for an open contact is not.
    size
        Diameter of the markers in pt; 0 for events too many for that, which become ticks at the lower edge.
    """

    label: str
    time: NDArray[np.float64]
    colour: str
    marker: str
    filled: bool
    size: float

    def handle(self) -> Line2D:
        """Return the entry of the legend."""
        return Line2D([], [], label=self.label, **self._look())

    def draw(self, axes: Axes, factor: float, curve: tuple[NDArray, NDArray] | None) -> None:
        """Mark the events.

        Parameters
        ----------
        axes
            Axes whose horizontal axis is time.
        factor
            From s to the unit of the time axis.
        curve
            Time (s) and value (unit of the axis) of the curve to mark; None, as of a force, which may jump at
            an event, marks at the lower edge of the axes.
        """
        if curve is None or self.size == 0.0:
            at, low = self.time * factor, np.full(self.time.shape, 0.03)
            axes.plot(at, low, transform=axes.get_xaxis_transform(), label=self.label, zorder=3, **self._look())
            return
        value = np.interp(self.time, *curve)
        axes.plot(self.time * factor, value, label=self.label, zorder=3, **self._look())

    def _look(self) -> dict[str, Any]:
        if self.size == 0.0:
            return _tick(self.colour)
        return {
            "linestyle": "none",
            "marker": self.marker,
            "markersize": self.size,
            "markeredgewidth": 0.6,
            "color": self.colour,
            "markerfacecolor": self.colour if self.filled else "white",
        }


def _tick(colour: str) -> dict[str, Any]:
    return {"linestyle": "none", "marker": "|", "markersize": 4.0, "markeredgewidth": 0.5, "color": colour}


def event_marks(result: RunResult, start: float, stop: float) -> list[Marks]:
    """Return the events between `start` and `stop` (s), grouped by contact and state while the groups are few."""
    events = result.events
    if events is None:
        return []
    inside = (events.time >= start) & (events.time <= stop)
    time, contact, state = events.time[inside], events.contact[inside], events.state[inside]
    if time.size == 0:
        return []
    size = 3.0 if time.size <= MOST_LARGE_MARKERS else 2.0 if time.size <= MOST_MARKERS else 0.0
    groups = np.unique(np.stack((contact, state)), axis=1).T
    if len(groups) > MOST_GROUPS:
        return [Marks("contact events", time, style.RED, "o", True, size)]
    names, contacts = result.contacts, np.unique(contact).tolist()
    marks: list[Marks] = []
    for number, value in groups.tolist():
        name = names[number - 1] if 1 <= number <= len(names) else f"contact {number}" if number > 0 else "event"
        words = result.state_meanings(number).get(value, f"state {value}" if value >= 0 else "")
        colour = style.EVENT_COLOURS[contacts.index(number) if len(contacts) > 1 else len(marks)]
        chosen = (contact == number) & (state == value)
        branch = branch_of(words)
        is_open = branch == OPEN
        if is_open and _twice_in_a_row(state[contact == number], value):
            words, is_open = words.replace(OPEN, OPEN_AGAIN), False
        label = f"{name}: {words}" if words else name
        marks.append(Marks(label, time[chosen], colour, MARKERS.get(branch, "o"), not is_open, size))
    return marks


def _twice_in_a_row(state: NDArray[np.int64], value: int) -> bool:
    """Return whether a contact enters a branch that it is in."""
    return bool(np.any((state[1:] == value) & (state[:-1] == value)))
