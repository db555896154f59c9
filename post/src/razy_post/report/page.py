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

from razy_post.plot.style import CM, look
from razy_post.report.manifest import (
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
from razy_post.report.measure import Measured

COLOURS = {
    AGREES: "#2a7a3a", DEPENDS: "#8a6d00", CONTRADICTS: "#c1272d", HELD: "#2a4a7a", UNDECIDED: "#4a5a6a",
    MISSED: "#7a007a", FAILED: "#7a007a",
}  # fmt: skip
# The part of a page that is left below its text, with less of which pictures get a page of their own.
ENOUGH_FOR_PICTURES = 0.45
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
    def quotes(self) -> list[str]:
        """What is quoted of the source, and with which value of what it leaves open that holds."""
        lines = []
        for quote in dict.fromkeys(one.number.quote for one in self.measured if one.number.quote):
            of = [one for one in self.measured if one.number.quote == quote]
            choices = dict.fromkeys(one.number.choice for one in of if one.number.choice)
            held = [choice for choice in choices if all(one.holds for one in of if one.number.choice in ("", choice))]
            lines.append(f"“{quote}”" + (f" (holds with: {'; '.join(held) or 'nothing tried'})" if choices else ""))
        return lines

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
    path.write_text("\n".join(parts) + "\n", encoding="utf-8")


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
    """Write the report for printing: a list of verdicts, then for each item a page of A4, or two."""
    # The look is that of the fonts, too, which are written when the file is closed.
    with look(), PdfPages(path, metadata={"Title": manifest.title}) as pages:
        for first in range(0, max(len(entries), 1), 55):
            page = _Page()
            page.write(manifest.title, 14.0)
            page.write(f"{counts(entries)}. {manifest.introduction}", 9.0)
            for name, says in _key_to(entries):
                page.write(f"{name}: {says}", 7.5, COLOURS[name])
            for entry in entries[first : first + 55]:
                line = textwrap.shorten(f"{entry.item.name}. {entry.item.caption}", 95)
                page.write(f"{line}  —  {entry.verdict}", 7.5, COLOURS[entry.verdict])
            pages.savefig(page.figure)
        for entry in entries:
            page = _Page()
            page.write(f"{entry.item.name}. {entry.item.caption}", 11.0)
            page.write(entry.item.caption_cs, 8.5, "0.35")
            page.write(entry.verdict, 10.0, COLOURS[entry.verdict])
            page.write(entry.item.source and f"The source: {entry.item.source}", 8.5)
            for line in (*entry.quotes, *entry.lines, *entry.problems, entry.item.note):
                page.write(line, 8.5)
            for table in entry.tables:
                for row in table:
                    page.write("     ".join(f"{text:>10}" for text in row), 8.0)
            page.write(_small_print(entry), 6.5, "0.4")
            if entry.pictures and page.top < ENOUGH_FOR_PICTURES:
                pages.savefig(page.figure)
                page = _Page()
            page.pictures(entry.pictures)
            pages.savefig(page.figure)


class _Page:
    """A page of A4 that is filled from above."""

    def __init__(self) -> None:
        self.figure = Figure(figsize=(21.0 * CM, 29.7 * CM))
        self.top = 0.955

    def write(self, text: str, size: float, colour: str = "black") -> None:
        for line in textwrap.wrap(text, int(1080 / size)) if text else ():
            self.figure.text(0.09, self.top, line.replace("$", r"\$"), fontsize=size, color=colour, va="top")
            self.top -= 1.35 * size / 842.0

    def pictures(self, pictures: Sequence[bytes]) -> None:
        """Put the pictures into the rest of the page, in columns that use it best."""
        if not pictures:
            return
        images = [matplotlib.image.imread(BytesIO(picture), format="png") for picture in pictures]
        room = self.top - 0.06
        layouts = [
            (min(self._width(image, columns, len(images), room) for image in images), columns) for columns in (1, 2, 3)
        ]
        _, columns = max(layouts)
        rows = -(-len(images) // columns)
        for number, image in enumerate(images):
            width, height = 0.82 / columns, room / rows
            left, bottom = 0.09 + (number % columns) * width, 0.05 + (rows - 1 - number // columns) * height
            axes = self.figure.add_axes((left, bottom, 0.98 * width, 0.97 * height))
            axes.imshow(image, interpolation="antialiased")
            axes.set_axis_off()

    @staticmethod
    def _width(image, columns: int, count: int, room: float) -> float:
        """Return the width that an image gets, in widths of the page."""
        height = room / -(-count // columns) * 29.7 / 21.0
        return min(0.82 / columns, height * image.shape[1] / image.shape[0])


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
