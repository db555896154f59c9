"""The report as one HTML page with everything in it, and as a PDF."""

import base64
import math
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape
from io import BytesIO
from pathlib import Path

import matplotlib.image
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure

from razy.errors import one_line
from razy.plot.style import CM, look
from razy.report.manifest import (
    AGREES,
    CONTRADICTS,
    DEPENDS,
    FAILED,
    HELD,
    MISSED,
    UNDECIDED,
    VERDICTS,
    Item,
    Manifest,
)
from razy.report.measure import Measured
from razy.target import write_bytes, write_text

COLOURS = {
    AGREES: "#2a7a3a", DEPENDS: "#8a6d00", CONTRADICTS: "#c1272d", HELD: "#2a4a7a", UNDECIDED: "#4a5a6a",
    MISSED: "#7a007a", FAILED: "#7a007a",
}  # fmt: skip
TOP, BOTTOM, BETWEEN, TEXT_WIDTH = 0.955, 0.05, 0.012, 0.82
# What has to be left of a page for an item to begin there, and the width below which pictures get a page of their own.
WITH_PICTURES, WITHOUT_PICTURES, NARROW = 0.38, 0.2, 0.3
# Quotations of fewer characters, such as numbers, share a line.
SHORT = 60
STYLE = """
body { font: 15px/1.45 Georgia, serif; max-width: 60em; margin: 2em auto; padding: 0 1em; color: #111; }
h1 { font-size: 1.6em; } h2 { font-size: 1.15em; margin: 0 0 .3em; }
section { border-top: 1px solid #bbb; padding: 1em 0; break-inside: avoid; }
.cs { color: #555; font-style: italic; margin: 0; } .verdict { font-weight: bold; float: right; }
figure { margin: .6em 0; display: inline-block; vertical-align: top; } img { max-width: 100%; }
table { border-collapse: collapse; margin: .5em 0; }
td, th { padding: .1em .8em .1em 0; text-align: left; vertical-align: top; }
td.n { text-align: right; font-variant-numeric: tabular-nums; }
th { border-bottom: 1px solid #888; font-weight: normal; }
.small { color: #666; font-size: .8em; } .failed { color: #7a007a; }
"""


@dataclass
class Entry:
    """What a report shows of an item; pictures are PNG files as bytes, tables have their heads as first row."""

    item: Item
    verdict: str
    measured: Sequence[Measured]
    pictures: list[bytes] = field(default_factory=list)
    tables: list[list[list[str]]] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    seconds: float = 0.0
    commit: str = ""

    @property
    def turned(self) -> bool:
        """Whether the verdict is another than the expected one."""
        return bool(self.item.expected) and self.verdict != self.item.expected

    @property
    def reasons(self) -> str:
        """Why it failed, in one line; empty if it did not."""
        numbers = [f"{one.number.text}: {one.problem}" for one in self.measured if one.problem]
        return one_line("; ".join([*self.problems, *numbers]))

    @property
    def quotes(self) -> list[str]:
        """What is quoted of the source, and with which value of what it leaves open that holds."""
        lines, short = [], []
        for quote in dict.fromkeys(one.number.quote for one in self.measured if one.number.quote):
            of = [one for one in self.measured if one.number.quote == quote]
            choices = dict.fromkeys(one.number.choice for one in of if one.number.choice)
            held = [choice for choice in choices if all(one.holds for one in of if one.number.choice in ("", choice))]
            if choices:
                lines.append(f"“{quote}” (holds with: {'; '.join(held) or 'nothing tried'})")
            else:
                (short if len(quote) < SHORT else lines).append(f"“{quote}”")
        return [*lines, ", ".join(short)] if short else lines

    @property
    def lines(self) -> list[str]:
        """What was measured, a line for each number."""
        return [f"{one.number.text}: {_value(one)}{_against(one)}" for one in self.measured]


def counts(entries: Sequence[Entry]) -> str:
    """Return how many items have which verdict, in words."""
    found = {verdict: sum(entry.verdict == verdict for entry in entries) for verdict in COLOURS}
    return ", ".join(f"{number} {verdict}" for verdict, number in found.items() if number)


def write_html(manifest: Manifest, entries: Sequence[Entry], path: Path) -> None:
    """Write the page."""
    parts = [
        f"<!doctype html><html lang=en><meta charset=utf-8><title>{escape(manifest.title)}</title>",
        f"<style>{STYLE}</style>",
        f"<h1>{escape(manifest.title)}</h1><p>{escape(manifest.introduction)}</p>",
        f"<p><b>{counts(entries)}.</b> {sum(e.seconds for e in entries):.0f} s of one processor.</p>",
        *(f"<p class=small><b>{escape(verdict)}:</b> {escape(says)}</p>" for verdict, says in _key_to(entries)),
        "<table>",
    ]
    for entry in entries:
        parts.append(
            f"<tr><td><a href='#{_anchor(entry)}'>{escape(entry.item.name)}</a><td>{escape(entry.item.caption)}"
            f"<td style='color:{COLOURS[entry.verdict]}'>{entry.verdict}"
        )
    parts.append("</table>")
    parts.extend(_section(entry) for entry in entries)
    write_text(path, "\n".join(parts) + "\n")


def _key_to(entries: Sequence[Entry]) -> list[tuple[str, str]]:
    """Return what the verdicts of these items mean."""
    return [pair for pair in VERDICTS.items() if any(entry.verdict == pair[0] for entry in entries)]


def _section(entry: Entry) -> str:
    item = entry.item
    parts = [
        f"<section id='{_anchor(entry)}'>",
        f"<span class=verdict style='color:{COLOURS[entry.verdict]}'>{entry.verdict}</span>",
        f"<h2>{escape(item.name)}. {escape(item.caption)}</h2>",
    ]
    if item.caption_cs:
        parts.append(f"<p class=cs lang=cs>{escape(item.caption_cs)}</p>")
    if item.source:
        parts.append(f"<p><b>The source:</b> {escape(item.source)}</p>")
    parts.extend(f"<p class=cs lang=cs>{escape(line)}</p>" for line in entry.quotes)
    for picture in entry.pictures:
        parts.append(f"<figure><img alt='' src='data:image/png;base64,{base64.b64encode(picture).decode()}'></figure>")
    if entry.measured:
        parts.append("<table><tr><th>number<th>here<th>should be<th><th>by")
        for one in entry.measured:
            mark = {None: "", True: "yes", False: "no"}[one.holds]
            by = "" if one.holds is None else "the source" if one.number.quote else "razy"
            value = escape(one.problem) if one.problem else _value(one)
            parts.append(
                f"<tr><td>{escape(one.number.text)}<td class=n>{value}<td>{escape(one.wanted)}<td>{mark}<td>{by}"
            )
        parts.append("</table>")
    for head, *rows in entry.tables:
        parts.append("<table><tr>" + "".join(f"<th>{escape(text)}" for text in head))
        parts.extend("<tr>" + "".join(f"<td class=n>{escape(text)}" for text in row) for row in rows)
        parts.append("</table>")
    parts.extend(f"<p class=failed>{escape(problem)}</p>" for problem in entry.problems)
    if item.note:
        parts.append(f"<p>{escape(item.note)}</p>")
    parts.append(f"<p class=small>{escape(_small_print(entry))}</p></section>")
    return "\n".join(parts)


def write_pdf(manifest: Manifest, entries: Sequence[Entry], path: Path) -> None:
    """Write the report for printing on A4: a list of verdicts, then the items, one below the other."""
    # The look is that of the fonts, too, which are written when the file is closed.
    content = BytesIO()
    with look(), PdfPages(content, metadata={"Title": manifest.title}) as pages:
        document = _Document(pages)
        document.write(manifest.title, 14.0)
        document.write(f"{counts(entries)}. {manifest.introduction}", 9.0)
        for name, says in _key_to(entries):
            document.write(f"{name}: {says}", 7.5, COLOURS[name])
        for entry in entries:
            line = textwrap.shorten(f"{entry.item.name}. {entry.item.caption}", 95)
            document.write(f"{line}  —  {entry.verdict}", 7.5, COLOURS[entry.verdict])
        for number, entry in enumerate(entries):
            document.begin(WITH_PICTURES if entry.pictures else WITHOUT_PICTURES, turn=number == 0)
            document.write(f"{entry.item.name}. {entry.item.caption}", 11.0)
            document.write(entry.item.caption_cs, 8.5, "0.35")
            document.write(entry.verdict, 10.0, COLOURS[entry.verdict])
            document.write(entry.item.source and f"The source: {entry.item.source}", 8.5)
            for line in (*entry.quotes, *entry.lines, *entry.problems, entry.item.note):
                document.write(line, 8.5)
            for table in entry.tables:
                for row in table:
                    document.write("     ".join(f"{text:>10}" for text in row), 8.0)
            document.write(_small_print(entry), 6.5, "0.4")
            document.pictures(entry.pictures)
        document.end()
    write_bytes(path, content.getvalue())


class _Document:
    """Pages of A4 that are filled from above; places are parts of their height, widths parts of their width."""

    def __init__(self, pages: PdfPages) -> None:
        self.pages = pages
        self._turn()

    def begin(self, height: float, turn: bool) -> None:
        """Begin an item: below the one before if this much is left of the page, else on a new one."""
        if turn or self.top - 2 * BETWEEN < BOTTOM + height:
            self.end()
            self._turn()
        elif self.top < TOP:
            self.top -= 2 * BETWEEN

    def end(self) -> None:
        """Write the page."""
        self.pages.savefig(self.figure)

    def write(self, text: str, size: float, colour: str = "black") -> None:
        for line in textwrap.wrap(text, int(1080 / size)) if text else ():
            if self.top < BOTTOM:
                self.end()
                self._turn()
            self.figure.text(0.09, self.top, line, fontsize=size, color=colour, va="top", parse_math=False)
            self.top -= 1.35 * size / 842.0

    def pictures(self, pictures: Sequence[bytes]) -> None:
        """Put pictures below the text, in columns that use the rest of the page best, or on a page of their own."""
        if not pictures:
            return
        images = [matplotlib.image.imread(BytesIO(picture), format="png") for picture in pictures]
        steepest = max(image.shape[0] / image.shape[1] for image in images) * 21.0 / 29.7
        width, columns = self._layout(len(images), steepest)
        if width < NARROW:
            self.end()
            self._turn()
            width, columns = self._layout(len(images), steepest)
        self.top -= BETWEEN
        for number, image in enumerate(images):
            column, row = number % columns, number // columns
            left, bottom = 0.09 + column * TEXT_WIDTH / columns, self.top - (row + 1) * width * steepest
            axes = self.figure.add_axes((left, bottom, 0.98 * width, 0.98 * width * steepest), anchor="NW")
            axes.imshow(image, interpolation="antialiased")
            axes.set_axis_off()
        self.top -= -(-len(images) // columns) * width * steepest

    def _layout(self, count: int, steepest: float) -> tuple[float, int]:
        """Return the width that each picture gets, and in how many columns they stand."""
        room = self.top - BETWEEN - BOTTOM
        return max((min(TEXT_WIDTH / n, room / (-(-count // n) * steepest)), n) for n in (1, 2, 3))

    def _turn(self) -> None:
        self.figure = Figure(figsize=(21.0 * CM, 29.7 * CM))
        self.top = TOP


def _anchor(entry: Entry) -> str:
    return "i" + "".join(c if c.isalnum() else "-" for c in entry.item.name)


def _value(one: Measured) -> str:
    if one.problem:
        return one.problem
    if math.isnan(one.value):
        return "none"
    size = abs(one.value)
    if size == 0.0 or 1e-4 <= size < 1e7:
        return (
            f"{one.value:.{one.number.digits}f}".rstrip("0").rstrip(".")
            if "." in f"{one.value:.{one.number.digits}f}"
            else f"{one.value:.0f}"
        )
    return f"{one.value:.{one.number.digits}g}"


def _against(one: Measured) -> str:
    if one.holds is None:
        return ""
    by = "source" if one.number.quote else "razy"
    return f" ({by}: {one.wanted}: {'yes' if one.holds else 'no'})"


def _small_print(entry: Entry) -> str:
    inputs = ", ".join(
        " ".join((case.input, *(f"--set {value}" for value in case.set))) for case in entry.item.case[:6]
    )
    more = f" and {len(entry.item.case) - 6} more" if len(entry.item.case) > 6 else ""
    turned = f"; expected: {entry.item.expected}" if entry.turned else ""
    return f"{inputs}{more}; {entry.seconds:.1f} s; commit {entry.commit or 'unknown'}{turned}"
