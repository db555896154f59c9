"""The states of contacts over time."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from razy.errors import ResultError
from razy.plot import style
from razy.plot.options import PlotOptions
from razy.plot.units import in_words, scale_for
from razy.read import RunResult
from razy.read.file import branch_of

COLOURS = {
    "open": "#ffffff",
    "closed (upper side)": "#2b2b2b",
    "closed (lower side)": "#1f5fa8",
    "parting (upper side)": "#8a8a8a",
    "parting (lower side)": "#7fb2d6",
    "sliding forward": "#e0a060",
    "sliding backward": "#c1272d",
    "sticking": "#2a8a4a",
    "strained forward": "#2a8a4a",
    "strained backward": "#2a8a4a",
}
UNKNOWN = "#eeeeee"


def draw(result: RunResult, figure: Figure, options: PlotOptions) -> None:
    """Draw a bar for each contact, in the colour of its state; the state before its first event is not known."""
    names = result.contacts
    if result.events is None or not names:
        raise ResultError(f"{result.path}: the file holds no events of contacts")
    for name in options.coordinates:
        if name not in names:
            raise ResultError(f"{result.path}: no contact '{name}' (the file has: {', '.join(names)})")
    chosen = options.coordinates or names
    last = result.end if options.stop is None else options.stop
    first = 0.0 if options.start is None else options.start
    if not last > first:
        raise ResultError(f"{result.path}: no time {options.range_text()}")
    scale = scale_for("s", last)
    style.set_size(figure, options, 16.0, 2.6 + 0.9 * len(chosen))
    axes = figure.subplots()
    shown = {}
    for row, name in enumerate(chosen):
        for begin, end, word in bars(result, name, first, last):
            colour = UNKNOWN if word is None else COLOURS.get(word, style.GREY)
            shown[word or "before the first event"] = colour
            begin, end = begin * scale.factor, end * scale.factor
            axes.barh(row, end - begin, left=begin, height=0.7, color=colour, linewidth=0.0)
        axes.barh(row, (last - first) * scale.factor, left=first * scale.factor, height=0.7, fill=False, linewidth=0.4)
    axes.set_yticks(range(len(chosen)), [in_words(name) for name in chosen])
    axes.tick_params(axis="y", which="both", length=0)
    axes.minorticks_off()
    axes.invert_yaxis()
    axes.set_xlim(first * scale.factor, last * scale.factor)
    axes.set_xlabel(f"time ({scale.unit})")
    handles = [Patch(facecolor=colour, edgecolor="0.4", linewidth=0.4, label=word) for word, colour in shown.items()]
    style.set_footer(figure, result, options)
    style.set_heading(figure, (axes, axes), style.title_of(result, options), handles)


def bars(result: RunResult, contact: str, first: float, last: float) -> list[tuple[float, float, str | None]]:
    """Return beginning, end and state of a contact in words between two times; None before its first event."""
    events, number = result.events, result.contacts.index(contact) + 1
    mine, meanings = events.contact == number, result.state_meanings(number)
    time = np.concatenate(([min(first, 0.0)], events.time[mine], [max(last, result.end)]))
    state = [None, *(meanings.get(int(value), f"state {value}") for value in events.state[mine])]
    pieces = zip(np.clip(time[:-1], first, last), np.clip(time[1:], first, last), state, strict=True)
    # Of a mesh whose stiffness switches the states with one and with two pairs of teeth are one.
    return [(float(begin), float(end), word and branch_of(word)) for begin, end, word in pieces if end > begin]
