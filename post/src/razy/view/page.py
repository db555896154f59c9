"""The page of ``razy-view``, by Bokeh: the diagram of a sweep, and motions beside it."""

import secrets
import warnings
import webbrowser
from html import escape
from typing import Any

import numpy as np
from bokeh.application import Application
from bokeh.application.handlers.function import FunctionHandler
from bokeh.document import Document
from bokeh.embed import file_html
from bokeh.events import Tap
from bokeh.layouts import column, row
from bokeh.models import CustomJS, Div, LayoutDOM, PlainText, Select, Span
from bokeh.palettes import Viridis256
from bokeh.plotting import figure
from bokeh.resources import INLINE
from bokeh.server.server import BaseServer
from bokeh.server.tornado import BokehTornado
from bokeh.transform import linear_cmap
from numpy.typing import NDArray
from tornado.httpserver import HTTPServer
from tornado.ioloop import IOLoop
from tornado.netutil import bind_sockets
from tornado.routing import HostMatches, Rule, RuleRouter

from razy.errors import ResultError, one_line
from razy.plot import PlotNote, maps, section, style
from razy.plot.options import PlotOptions
from razy.plot.pattern import COLOURS, UNKNOWN, bars
from razy.plot.sampled import Course
from razy.plot.signals import Signal, observable, signals
from razy.plot.spectrum import spectrum
from razy.plot.units import axis_label, in_words, scale_for
from razy.read import Quantity, RunResult, open_result
from razy.read.file import making_sense_of
from razy.view.sweep import Motion, Sweep

MOTIONS = (style.BLACK, *style.EVENT_COLOURS)
MOST_SIGNALS = 6
TOOLS = {"tools": "pan,wheel_zoom,box_zoom,reset,save", "active_drag": "box_zoom"}
# More extrema than this are thinned out: a browser becomes slow.
MOST_POINTS = 300_000
# Names by which the page may be asked for: another name that leads here is someone else's page reading ours.
HOSTS = ("localhost", "127.0.0.1")


class View:
    """The page: `choose` computes and shows the motion at a point, beside the one before."""

    def __init__(self, sweep: Sweep, points: list[int]) -> None:
        self.sweep = sweep
        self.shown: list[tuple[int, Motion]] = []
        self.status = _text(width=640)
        self.commands = _text(width=640)
        self.motions = column(Div())
        self.notes: list[str] = []
        self.factors = [1.0] * len(sweep.axes)
        with making_sense_of(sweep.file):
            self.diagram = self._diagram()
        head = _text(text=f"<h2>{escape(sweep.result.title or str(sweep.file))}</h2>")
        left = column(self.diagram, self.status, self.commands)
        self.layout = column(head, row(left, self.motions))
        self.say(("Click on the diagram to see the motion there. " if not points else "") + sweep.note)
        for point in points:
            self.choose(point, most=len(points))

    def say(self, text: str) -> None:
        """Show a line below the diagram."""
        self.status.text = escape(text)

    def tap(self, x: float, y: float) -> None:
        """Show the motion at the point nearest to a place of the diagram."""
        place = [value / factor for value, factor in zip((x, y), self.factors, strict=False)]
        place = [float(np.clip(v, a.min(), a.max())) for v, (_, a) in zip(place, self.sweep.axes, strict=True)]
        self.choose(self.sweep.nearest(place))

    def choose(self, point: int, most: int = 2) -> None:
        """Compute the motion at a point and show it with those before, of all the last `most`."""
        try:
            motion = self.sweep.motion(point)
            self.shown = [*self.shown, (point, motion)][-most:]
            self.motions.children = [self._panels()]
        except ResultError as error:
            self.say(one_line(str(error)))
            return
        self.say("; ".join([note for note in (self.sweep.note, *self.notes) if note]))
        self._mark()
        self.commands.text = "<b>To repeat:</b>" + "".join(
            f"<pre style='color:{colour}'># {escape(motion.label)}\n{escape(self.sweep.command(point))}</pre>"
            for (point, motion), colour in zip(self.shown, MOTIONS, strict=False)
        )

    def _mark(self) -> None:
        """Mark the points of the motions shown in the diagram."""
        self.diagram.center = [item for item in self.diagram.center if not isinstance(item, Span)]
        for (point, _), colour in zip(self.shown, MOTIONS, strict=False):
            for value, factor, way in zip(self.sweep.grid[point], self.factors, ("height", "width"), strict=False):
                self.diagram.add_layout(
                    Span(location=value * factor, dimension=way, line_color=colour, line_dash="dashed")
                )

    def _diagram(self) -> figure:
        result = self.sweep.result
        described = [result.parameter(name) for name, _ in self.sweep.axes]
        scales = [
            scale_for(quantity.units, float(np.abs(axis).max()))
            for quantity, (_, axis) in zip(described, self.sweep.axes, strict=True)
        ]
        self.factors = [scale.factor for scale in scales]
        across = axis_label(described[0], scales[0])
        if len(scales) == 2:
            return self._map(across, axis_label(described[1], scales[1]))
        plot = _figure(across, "", 640, 480, output_backend="webgl")
        x = self.sweep.grid[:, 0] * self.factors[0]
        if result.observables:
            self._extrema(plot, x)
        elif result.contacts:
            values = {name: result.contact_value(name, "largest_force") for name in result.contacts}
            scale = scale_for("N", max(float(np.nanmax(np.abs(v), initial=0.0)) for v in values.values()))
            for (name, value), colour in zip(values.items(), MOTIONS * len(values), strict=False):
                plot.line(x, value * scale.factor, color=colour, legend_label=in_words(name))
            plot.yaxis.axis_label = PlainText(axis_label(Quantity("force", "N", "largest force"), scale))
        else:
            raise ResultError(f"{result.path}: holds neither extrema nor statistics of contacts")
        return plot

    def _extrema(self, plot: figure, x: NDArray[np.float64]) -> None:
        """Draw the extrema of the first observable: maxima grey and minima black, or both ways in their colours."""
        result = self.sweep.result
        extrema = result.extrema(result.observables[0])
        found, direction = extrema.all(), result.direction
        at = np.repeat(x, extrema.counts)
        layer, looks = found.kind, style.EXTREMA
        if direction is not None:
            layer, looks = np.repeat(direction, extrema.counts), style.DIRECTIONS
        step = max(1, -(-at.size // MOST_POINTS))
        scale = scale_for(extrema.quantity.units, float(np.nanmax(np.abs(found.value), initial=0.0)))
        for key, (name, colour) in looks.items():
            keep = np.flatnonzero(layer == key)[::step]
            if keep.size:
                plot.scatter(
                    at[keep], found.value[keep] * scale.factor, size=2, color=colour, legend_label=name, line_width=0
                )
        plot.yaxis.axis_label = PlainText(axis_label(extrema.quantity, scale))
        if plot.legend:
            plot.add_layout(plot.legend[0], "above")
            plot.legend[0].orientation = "horizontal"

    def _map(self, across: str, up: str) -> figure:
        """Draw a number of each point as colour."""
        result = self.sweep.result
        name = (*maps.default_names(result), "")[0]
        if not name:
            raise ResultError(
                f"{result.path}: holds no statistics of contacts, no period of the motions and no extrema"
            )
        count = int(np.prod([axis.size for _, axis in self.sweep.axes]))
        value = np.asarray(maps.values(result, name), dtype=np.float64)[:count]
        described = maps.describe(result, name)
        scale = scale_for(described.units, float(np.nanmax(np.abs(value), initial=0.0)))
        value *= scale.factor
        plot = _figure(across, up, 640, 480)
        x, y = (self.sweep.grid[:count, k] * self.factors[k] for k in range(2))
        sizes = [
            np.ptp(axis) * factor / max(axis.size - 1, 1) or 1.0
            for (_, axis), factor in zip(self.sweep.axes, self.factors, strict=True)
        ]
        colours = linear_cmap("value", Viridis256, float(np.nanmin(value)), float(np.nanmax(value)))
        cells = plot.rect("x", "y", *sizes, color=colours, source={"x": x, "y": y, "value": value})
        plot.add_layout(cells.construct_color_bar(title=PlainText(axis_label(described, scale))), "right")
        return plot

    def _panels(self) -> LayoutDOM:
        """Return pictures of the motions that are shown: of the signal that is chosen, and contacts over time."""
        results = [open_result(self.sweep.motion(point).file) for point, _ in self.shown]
        try:
            chosen = [signals(result, PlotOptions(), MOST_SIGNALS) for result in results]
            with warnings.catch_warnings(record=True) as notes:
                warnings.simplefilter("always", PlotNote)
                panels = {in_words(parts[0].value.name): _signal(results, parts) for parts in zip(*chosen, strict=True)}
            self.notes = list(dict.fromkeys(str(note.message) for note in notes))
            panels |= {f"orbit of {node}": _orbit(results, node) for node in section.shaft_nodes(results[0])}
            return column(*_one_of(panels), *_contacts(results))
        finally:
            for result in results:
                result.close()


def _figure(across: str, up: str, width: int, height: int, **options: Any) -> figure:
    labels = {"x_axis_label": PlainText(across), "y_axis_label": PlainText(up)}
    plot = figure(width=width, height=height, **labels, **TOOLS, **options)
    plot.toolbar.logo = None
    return plot


def _text(**options: Any) -> Div:
    """Return a text in which a user's names and titles are no formulas: TeX could hold links."""
    return Div(disable_math=True, **options)


def _one_of(panels: dict[str, LayoutDOM]) -> list[LayoutDOM]:
    """Return panels of which one is seen, and what chooses it if there are several."""
    names = list(panels)
    for name, panel in panels.items():
        panel.visible = name == names[0]
    if len(names) == 1:
        return [*panels.values()]
    choice = Select(value=names[0], options=names, width=300)
    code = "panels.forEach((panel, i) => panel.visible = names[i] == this.value)"
    choice.js_on_change("value", CustomJS(args={"panels": [*panels.values()], "names": names}, code=code))
    return [choice, *panels.values()]


def _signal(results: list[RunResult], parts: tuple[Signal, ...]) -> LayoutDOM:
    """Return time history, phase path and spectrum of a signal of each motion."""
    value, rate = parts[0].value, parts[0].rate
    courses = [Course(result, part, PlotOptions()) for result, part in zip(results, parts, strict=True)]
    scale = scale_for(value.units, max(float(np.abs(course.value).max()) for course in courses))
    speed = scale_for(rate.units, max(float(np.abs(course.rate).max()) for course in courses))
    late = max(float(course.time[-1]) for course in courses)
    clock = scale_for("s", late)
    time = _figure(f"time ({clock.unit})", axis_label(value, scale), 620, 260)
    path = _figure(axis_label(value, scale), axis_label(rate, speed), 310, 300)
    power = _figure("frequency (Hz)", f"amplitude ({scale.unit})", 310, 300, y_axis_type="log")
    for course, colour in zip(courses, MOTIONS * len(courses), strict=False):
        time.line(course.time * clock.factor, course.value * scale.factor, color=colour)
        path.line(course.value * scale.factor, course.rate * speed.factor, color=colour)
        frequency, amplitude = spectrum(*reversed(course.even()))
        power.line(frequency[1:], np.maximum(amplitude[1:] * scale.factor, 1e-300), color=colour)
    return column(time, row(path, power))


def _orbit(results: list[RunResult], node: str) -> LayoutDOM:
    """Return the path of a shaft's node across the axis, with a mark once in each revolution."""
    ways = [[Course(r, observable(r, f"displacement.{node}.{way}"), PlotOptions()) for way in "vw"] for r in results]
    scale = scale_for("m", max(float(np.abs(course.value).max()) for both in ways for course in both))
    plot = _figure(f"{node}: along y ({scale.unit})", f"along z ({scale.unit})", 480, 480, match_aspect=True)
    for result, (v, w), colour in zip(results, ways, MOTIONS * len(results), strict=False):
        plot.line(v.value * scale.factor, w.value * scale.factor, color=colour)
        marks = section.revolutions(result, PlotOptions())
        if marks is not None:
            plot.scatter(v.at(marks) * scale.factor, w.at(marks) * scale.factor, size=5, color=colour)
    return column(plot)


def _contacts(results: list[RunResult]) -> list[LayoutDOM]:
    """Return the states of the contacts of each motion over the stored times."""
    plots = []
    for result, colour in zip(results, MOTIONS * len(results), strict=False):
        if result.events is None or not result.contacts:
            continue
        first, last = float(result.time[0]), float(result.time[-1])
        clock = scale_for("s", last)
        names = [in_words(name) for name in result.contacts]
        height = 70 + 28 * len(names)
        plot = _figure(f"time ({clock.unit})", "", 620, height, y_range=names[::-1], outline_line_color=colour)
        for name, words in zip(result.contacts, names, strict=True):
            drawn = bars(result, name, first, last)
            plot.hbar(
                y=[words] * len(drawn), left=[begin * clock.factor for begin, _, _ in drawn], height=0.7,
                right=[end * clock.factor for _, end, _ in drawn], line_width=0,
                color=[UNKNOWN if word is None else COLOURS.get(word, style.GREY) for _, _, word in drawn],
            )  # fmt: skip
        seen = {word for name in result.contacts for _, _, word in bars(result, name, first, last) if word}
        legend = " ".join(f"<span style='color:{COLOURS.get(w, style.GREY)}'>&#9632;</span> {w}" for w in sorted(seen))
        plots += [
            plot,
            _text(text=legend or "no event of a contact", styles={"background": "#dddddd", "padding": "0 4px"}),
        ]
    return plots


def static(sweep: Sweep, points: list[int]) -> str:
    """Return a page that needs nothing but a browser."""
    view = View(sweep, points)
    if len(view.shown) < len(points):
        raise ResultError(view.status.text)
    view.say(sweep.note)
    return file_html(view.layout, INLINE, sweep.result.title or sweep.file.name)


def serve(sweep: Sweep, points: list[int], port: int, browser: bool) -> None:
    """Show the page in a browser until the user interrupts.

    Its address holds a word that other users of this computer do not know.
    """

    def make(document: Document) -> None:
        view = View(sweep, points)
        document.title = sweep.result.title or sweep.file.name

        def tapped(event: Tap) -> None:
            view.say("computing ...")
            document.add_next_tick_callback(lambda: view.tap(event.x, event.y))

        view.diagram.on_event(Tap, tapped)
        document.add_root(view.layout)

    try:
        sockets = bind_sockets(port, "127.0.0.1")
    except (OSError, OverflowError) as cause:
        raise ResultError(f"--port {port}: {cause}") from cause
    port, word = sockets[0].getsockname()[1], secrets.token_urlsafe(16)
    origins = [f"{host}:{port}" for host in HOSTS]
    pages = BokehTornado({"/": Application(FunctionHandler(make))}, prefix=word, extra_websocket_origins=origins)
    http = HTTPServer(RuleRouter([Rule(HostMatches(f"^({'|'.join(HOSTS)})$"), pages)]))
    http.add_sockets(sockets)
    loop = IOLoop.current()
    BaseServer(loop, pages, http).start()
    address = f"http://localhost:{port}/{word}/"
    print(f"{address} (Ctrl-C ends it)", flush=True)
    if browser:
        loop.add_callback(webbrowser.open, address)
    loop.start()
