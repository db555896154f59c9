"""The manifest of a report, read from TOML and checked before anything runs."""

import reprlib
import sys
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import MISSING, dataclass, field, fields
from pathlib import Path
from types import UnionType
from typing import Any, get_args, get_origin, get_type_hints

from razy.errors import ResultError
from razy.plot import ARRANGEMENTS, PICTURES

AGREES, DEPENDS, CONTRADICTS = "agrees with the source", "depends on a choice not printed", "contradicts"
HELD, UNDECIDED, MISSED, FAILED = "held by razy", "cannot be decided", "missed", "failed"
# What each verdict compares with what.
VERDICTS = {
    AGREES: "every number with a quotation is as the printed number or sentence says",
    DEPENDS: "they are with one value of something the source does not print, and not with another",
    CONTRADICTS: "they are not, whatever was chosen",
    HELD: "nothing printed to compare with: a closed form, or bounds of razy's own",
    UNDECIDED: "the source says or prints too little to compare with",
    MISSED: "a closed form or a bound of razy's own is not kept",
    FAILED: "something could not be computed",
}
GIVEN = (AGREES, DEPENDS, CONTRADICTS, HELD, UNDECIDED)
PROGRAMS = ("run", "sweep", "modes", "tune", "duel", "follow")
REDUCTIONS = (
    "first",
    "last",
    "max",
    "min",
    "mean",
    "median",
    "sum",
    "count",
    "share",
    "spread",
    "share_positive",
    "max_over_min",
    "last_over_first",
    "ratio_of_intervals",
)
# More than the digits that a double has.
MOST_DIGITS = 17
CONDITIONS = ("==", "!=", "<", "<=", ">", ">=")
SEVERAL = {"run": ("time", "phase", "loop"), "sweep": ("column", "contacts")}


@dataclass(frozen=True)
class Case:
    """An input with options, computed by one program; `quick` are further options of a quick report."""

    input: str
    program: str
    name: str = ""
    set: tuple[str, ...] = ()
    quick: tuple[str, ...] = ()


@dataclass(frozen=True)
class Plot:
    """A picture of one case or of several; by default of the first case of its item.

    With `save` it is also a file of that name in the folder ``images`` of the report.
    """

    cases: tuple[str, ...] = ()
    kind: str = ""
    arrange: str = "overlay"
    labels: tuple[str, ...] = ()
    observables: tuple[str, ...] = ()
    coordinates: tuple[str, ...] = ()
    start: float | None = None
    stop: float | None = None
    title: str | None = None
    size: tuple[float, ...] | None = None
    swap: bool = False
    save: str = ""


@dataclass(frozen=True)
class Table:
    """Datasets of one case as columns of a table, at most `rows` long, in descending order of one of them if asked.

    Or the rows `take`, counted from 0, each beside texts that the source has `printed`; `heads` begin with those.
    """

    datasets: tuple[str, ...]
    heads: tuple[str, ...]
    case: str = ""
    digits: int = 4
    rows: int = 20
    order: int = 0
    magnitude: bool = False
    number: bool = False
    take: tuple[int, ...] = ()
    printed: tuple[tuple[str, ...], ...] = ()


@dataclass(frozen=True)
class Number:
    """A number that is read from a case, and what it should be.

    Of `dataset`, which may be a key of the input (``input:spring(2)%stiffness``), or of one `column` along its last
    dimension, those values are taken for which all `where` (dataset, condition, value or key of the input) hold, of
    these those where the dataset `at_largest` is largest, and of these the one with `index`; less or over the same of
    another case where `minus` or `over` names one; then reduced to one number, times `scale`. With `reduced` the other
    case is reduced first. Values of the points of a sweep may be asked for where extrema are what they are; then each
    stands once for each extremum.
    `should_be` is met within `tolerance` or within `factor`; nothing is decided where there is no value of what is
    `optional`.

    With a `quote` it is compared with the source, whose words or number these are; without one, with a closed form or
    with what razy holds of itself. Where the source leaves something open, `choice` says with which value of it the
    number comes.
    """

    text: str
    dataset: str
    case: str = ""
    index: tuple[int, ...] | None = None
    column: int | None = None
    where: tuple[tuple[str, str, float | str], ...] = ()
    at_largest: str = ""
    magnitude: bool = False
    reduce: str = "first"
    minus: str | None = None
    over: str | None = None
    reduced: bool = False
    scale: float = 1.0
    digits: int = 4
    should_be: float | None = None
    tolerance: float | None = None
    factor: float | None = None
    at_least: float | None = None
    at_most: float | None = None
    optional: bool = False
    quote: str = ""
    choice: str = ""

    @property
    def decides(self) -> bool:
        """Whether something is said of what it should be."""
        return (self.should_be, self.at_least, self.at_most) != (None, None, None)


@dataclass(frozen=True)
class Item:
    """A figure, table or statement of the source.

    `verdict`, that it cannot be decided, is said where the numbers cannot say it; `expected` is what the verdict is to
    be, or the report fails. A quick report leaves out what is `slow`, unless it is asked for by name.
    """

    name: str
    caption: str
    caption_cs: str = ""
    source: str = ""
    note: str = ""
    verdict: str = ""
    expected: str = ""
    slow: bool = False
    case: tuple[Case, ...] = ()
    plot: tuple[Plot, ...] = ()
    table: tuple[Table, ...] = ()
    number: tuple[Number, ...] = ()

    def case_called(self, name: str) -> Case:
        """Return a case by its name; the first if the name is empty."""
        return next(case for case in self.case if not name or case.name == name)


@dataclass(frozen=True)
class Manifest:
    """A report; inputs are relative to `folder`."""

    title: str
    item: tuple[Item, ...]
    introduction: str = ""
    folder: Path = field(default=Path())


class ManifestError(ResultError):
    """What is wrong with a manifest, a line for each thing."""


def read_manifest(path: Path) -> Manifest:
    """Read a manifest, or the ``report.toml`` of a folder; a `ManifestError` says all that is wrong."""
    if path.is_dir():
        path = path / "report.toml"
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as cause:
        raise ManifestError(f"{path}: {cause.strerror}") from cause
    except RecursionError as cause:
        raise ManifestError(f"{path}: brackets within brackets, too deep to read") from cause
    except ValueError as cause:
        raise ManifestError(f"{path}: {' '.join(str(cause).split())}") from cause
    problems: list[str] = []
    manifest = _make(Manifest, {**data, "folder": path.parent}, "", problems)
    if not problems:
        problems = list(_problems(manifest))
    if problems:
        raise ManifestError("\n".join(f"{path}: {problem}" for problem in problems))
    return manifest


PARTS = {"item": Item, "case": Case, "plot": Plot, "table": Table, "number": Number}
# What a value has to keep beside its kind, or each of a list.
LIMITS: dict[str, tuple[Callable[[Any], bool], str]] = {
    "digits": (lambda value: 0 <= value <= MOST_DIGITS, f"from 0 to {MOST_DIGITS}"),
    "rows": (lambda value: value >= 0, "0 or more"),
    "take": (lambda value: value >= 0, "a list of rows, counted from 0"),
    "tolerance": (lambda value: value >= 0.0, "0 or more"),
    "factor": (lambda value: value >= 1.0, "1 or more"),
}


def _make(kind: type, data: Any, where: str, problems: list[str]) -> Any:
    """Make an object of a table of the manifest; note what is wrong with it."""
    if not isinstance(data, dict):
        problems.append(f"{where}{reprlib.repr(data)}: has to be a table")
        return None
    known = {one.name: one for one in fields(kind)}
    for key in data:
        if key not in known:
            told = ", ".join(name for name in known if name != "folder")
            problems.append(f"{where}unknown key {reprlib.repr(key)} (known: {told})")
    needed = [one.name for one in known.values() if one.default is MISSING and one.default_factory is MISSING]
    missing = [key for key in needed if key not in data]
    problems.extend(f"{where}'{key}' is missing" for key in missing)
    if missing:
        return None
    kinds = get_type_hints(kind)
    return kind(**{key: _value(kinds[key], key, value, where, problems) for key, value in data.items() if key in known})


def _value(wanted: Any, key: str, value: Any, where: str, problems: list[str]) -> Any:
    if key in PARTS and wanted is not str and isinstance(value, list):
        parts = (f"{where}{_called(key, part, number)}: " for number, part in enumerate(value, 1))
        return tuple(_make(PARTS[key], part, at, problems) for part, at in zip(value, parts, strict=True))
    if not _fits(wanted, value):
        problems.append(f"{where}{key} = {reprlib.repr(value)}: has to be {_words(wanted)}")
    elif key in LIMITS and not all(LIMITS[key][0](v) for v in (value if isinstance(value, list) else [value])):
        problems.append(f"{where}{key} = {reprlib.repr(value)}: has to be {LIMITS[key][1]}")
    return tuple(tuple(v) if isinstance(v, list) else v for v in value) if isinstance(value, list) else value


def _called(key: str, part: Any, number: int) -> str:
    name = part.get("name") if key == "item" and isinstance(part, dict) else None
    return f"item '{name}'" if isinstance(name, str) and name.isprintable() else f"{key} {number}"


def _fits(wanted: Any, value: Any) -> bool:
    """Return whether a value of TOML, whose tuples are lists, is of a kind."""
    inner = get_args(wanted)
    if get_origin(wanted) is UnionType:
        return any(_fits(one, value) for one in inner)
    if get_origin(wanted) is tuple:
        kinds = [inner[0]] * len(value) if isinstance(value, list) and inner[-1] is ... else inner
        return isinstance(value, list) and len(value) == len(kinds) and all(map(_fits, kinds, value))
    if wanted is float:
        return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= sys.float_info.max
    if wanted is str:
        return isinstance(value, str) and value.replace("\n", "").replace("\t", "").isprintable()
    return isinstance(value, wanted) and isinstance(value, bool) == (wanted is bool)


def _words(wanted: Any) -> str:
    inner = [one for one in get_args(wanted) if one not in (type(None), ...)]
    if get_origin(wanted) is tuple:
        if ... in get_args(wanted):
            return "a list, each " + _words(inner[0])
        return f"a list of {len(inner)}: " + "; ".join(map(_words, inner))
    if inner:
        return " or ".join(map(_words, inner))
    plain = {
        str: "a text without control characters",
        int: "an integer",
        float: "a finite number",
        bool: "true or false",
    }
    return plain.get(wanted, "tables")


def _problems(manifest: Manifest) -> Iterator[str]:
    names = [item.name for item in manifest.item]
    for item in manifest.item:
        at = f"item '{item.name}': "
        if names.count(item.name) > 1:
            yield at + "the name is given twice"
        for key, known in (("verdict", (UNDECIDED,)), ("expected", GIVEN)):
            if getattr(item, key) and getattr(item, key) not in known:
                yield f"{at}{key} = '{getattr(item, key)}': known is {', '.join(known)}"
        for case in item.case:
            if case.program not in PROGRAMS:
                yield f"{at}program = '{case.program}': one of {', '.join(PROGRAMS)}"
            if not (manifest.folder / case.input).is_file():
                yield f"{at}input = '{case.input}': no such file"
        called = {case.name for case in item.case}
        if len(called) < len(item.case):
            yield at + "two cases have the same name"
        for plot in item.plot:
            yield from (at + problem for problem in _plot_problems(item, plot, called))
        for part in (*item.number, *item.table):
            for case in (part.case or None, getattr(part, "minus", None), getattr(part, "over", None)):
                if case is not None and case not in called:
                    yield f"{at}no case '{case}'"
            if not item.case:
                yield f"{at}numbers and tables need a case"
        yield from (at + problem for number in item.number for problem in _number_problems(number))
        for table in item.table:
            widths = {len(row) for row in table.printed} or {0}
            if {len(table.heads)} != {width + len(table.datasets) for width in widths} or not table.datasets:
                yield f"{at}a table has one head for each dataset, after those of what is printed"
            if not 0 <= table.order <= len(table.datasets):
                yield f"{at}order = {table.order}: from 0, none, to {len(table.datasets)}, the last of the datasets"
            if len(table.printed) not in (0, len(table.take)):
                yield f"{at}a table takes one row for each that is printed"
        if not item.verdict and not any(number.decides for number in item.number):
            yield f"{at}neither a verdict nor a number that decides one"


def _plot_problems(item: Item, plot: Plot, called: set[str]) -> Iterator[str]:
    if not item.case:
        yield "a picture needs a case"
    if plot.size is not None and (len(plot.size) != 2 or min(plot.size) <= 0.0):
        yield f"size = {list(plot.size)}: width and height, above 0"
    unknown = [case for case in plot.cases if case not in called]
    for case in unknown:
        yield f"no case '{case}'"
    if plot.save and (not plot.save.endswith(".png") or Path(plot.save).name != plot.save):
        yield f"save = '{plot.save}': a name that ends with .png, without a folder"
    if plot.arrange not in ARRANGEMENTS:
        yield f"arrange = '{plot.arrange}': one of {', '.join(ARRANGEMENTS)}"
    if unknown or not item.case:
        return
    programs = {item.case_called(case).program for case in plot.cases or ("",)}
    if len(programs) > 1:
        yield "a picture of files of different programs"
        return
    (program,) = programs
    kinds = SEVERAL.get(program, ()) if len(plot.cases) > 1 else _kinds(program)
    if (plot.kind and plot.kind not in kinds) or not kinds:
        yield f"kind = '{plot.kind}': no such picture of razy-{program} (has: {', '.join(kinds) or 'none of several'})"


def _kinds(program: str) -> tuple[str, ...]:
    return tuple(picture.kind for picture in PICTURES if picture.program == f"razy-{program}")


def _number_problems(number: Number) -> Iterator[str]:
    if number.reduce not in REDUCTIONS:
        yield f"reduce = '{number.reduce}': one of {', '.join(REDUCTIONS)}"
    if number.should_be is not None and (number.tolerance is None) == (number.factor is None):
        yield f"'{number.text}': should_be needs a tolerance or a factor"
    if number.should_be is None and (number.tolerance, number.factor) != (None, None):
        yield f"'{number.text}': a tolerance or a factor needs should_be"
    if number.factor is not None and number.should_be == 0.0:
        yield f"'{number.text}': a factor needs a should_be other than 0"
    if number.quote and not number.decides:
        yield f"'{number.text}': a quote needs should_be, at_least or at_most"
    if number.choice and not number.quote:
        yield f"'{number.text}': a choice needs a quote"
    for condition in number.where:
        if condition[1] not in CONDITIONS:
            yield f"'{number.text}': where is a list of [dataset, one of {' '.join(CONDITIONS)}, value]"
