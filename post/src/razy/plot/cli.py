"""The command ``razy-plot``."""

import argparse
import sys
import warnings
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

from matplotlib.figure import Figure

from razy.errors import Parser, ResultError, one_line
from razy.plot import ARRANGEMENTS, KINDS, QUANTITIES, PlotNote, PlotOptions, draw_files, output
from razy.plot.options import RESOLUTIONS, SIZES
from razy.plot.style import provenance
from razy.read import FollowResult, open_result
from razy.read.check import proved
from razy.read.file import making_sense_of
from razy.version import __version__

PROGRAM = "razy-plot"


def parser() -> Parser:
    """Return the parser of the command line."""
    result = Parser(
        prog=PROGRAM,
        description="Draw the picture that fits a result file of razy: a bifurcation diagram from razy-sweep, "
        "time histories and phase paths from razy-run, a Campbell diagram from razy-modes, "
        "objective and natural frequencies from razy-tune, branches of periodic motions from razy-follow.",
        epilog="Exit code: 0 done, 2 bad input or usage, 1 anything else.",
        allow_abbrev=False,
    )
    result.add_argument(
        "files",
        metavar="FILE.h5",
        type=Path,
        nargs="+",
        help="result file; several of a kind, or branches and a sweep, go together",
    )
    result.add_argument(
        "--save", metavar="FILE", type=Path, help="write the picture (.png, .pdf, .svg, ...) instead of showing it"
    )
    result.add_argument("--force", action="store_true", help="overwrite the picture if it exists")
    result.add_argument(
        "--kind",
        choices=KINDS,
        metavar="KIND",
        help="kind of picture; by default the one that fits the file; " + ", ".join(KINDS),
    )
    result.add_argument(
        "--observable", metavar="NAME", action="append", default=[], help="observable to draw; repeat for several"
    )
    result.add_argument(
        "--coordinate", metavar="NAME", action="append", default=[], help="coordinate to draw; repeat for several"
    )
    result.add_argument(
        "--arrange", choices=ARRANGEMENTS, default="overlay",
        help="several files: over one another (of two the first grey, the second black), side by side, with difference",
    )  # fmt: skip
    result.add_argument(
        "--label", metavar="TEXT", action="append", default=[], help="words for a file of several; repeat for each"
    )
    result.add_argument(
        "--quantity",
        choices=QUANTITIES,
        help="of branches: all extrema of the observable, the largest, the smallest, or the largest multiplier",
    )
    result.add_argument(
        "--check",
        metavar="FILE.h5",
        type=Path,
        help="file of razy-check: branches are marked where it proves them",
    )
    result.add_argument("--from", dest="start", metavar="X", type=_number, help="least parameter, or time in s")
    result.add_argument("--to", dest="stop", metavar="X", type=_number, help="largest parameter, or time in s")
    result.add_argument(
        "--top",
        metavar="Y",
        type=_number,
        help="highest frequency in Hz of a Campbell diagram or spectrum (rad/s of eigenvalues, order of an ordermap)",
    )
    result.add_argument(
        "--period", metavar="S", type=_period, help="period in s of a Poincare section or of an orbit's marks"
    )
    result.add_argument(
        "--swap", action="store_true", help="the swept parameter upwards, in pictures of the kind column"
    )
    result.add_argument("--title", metavar="TEXT", help="title instead of the one in the file; '' for none")
    result.add_argument("--size", metavar="WxH", type=_size, help="width and height in cm, such as 16x9.5")
    result.add_argument(
        "--dpi", metavar="N", type=_dpi, default=300, help="resolution of a saved picture (%(default)s)"
    )
    result.add_argument("--footer", action="store_true", help="file, version and commit in small print below")
    result.add_argument("--version", action="version", version=f"{PROGRAM} {__version__}")
    return result


def main(arguments: list[str] | None = None) -> int:
    """Run the command; return its exit code."""
    given = parser().parse_args(arguments)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        warnings.simplefilter("always", PlotNote)
        warnings.showwarning = lambda message, *_rest, **_more: print(f"{PROGRAM}: note: {message}", file=sys.stderr)
        try:
            _plot(given)
        except ResultError as error:
            return _fail(str(error), error.exit_code)
        except KeyboardInterrupt:
            return _fail("interrupted", 1)
        except Exception as error:
            return _fail(f"{type(error).__name__}: {error}", 1)
    return 0


def _plot(given: argparse.Namespace) -> None:
    options = PlotOptions(
        observables=tuple(given.observable),
        coordinates=tuple(given.coordinate),
        start=given.start,
        stop=given.stop,
        title=given.title,
        size=given.size,
        footer=given.footer,
        quantity=given.quantity,
        top=given.top,
        period=given.period,
        swap=given.swap,
    )
    if given.save is not None:
        output.check_target(given.save, given.files, given.force)
    with ExitStack() as stack:
        results = [stack.enter_context(open_result(file)) for file in given.files]
        show = given.save is None
        figure = output.new_window(f"{PROGRAM} {given.files[0]}") if show else Figure(dpi=given.dpi)
        if given.check is not None:
            branches = next((result for result in results if isinstance(result, FollowResult)), None)
            if branches is None:
                raise ResultError(f"{given.files[0]}: --check goes with branches of razy-follow alone")
            options = replace(options, proved=proved(given.check, branches))
        with making_sense_of(results[0].path):
            source = provenance(results[0])
        draw_files(results, figure, options, given.kind, given.label, given.arrange)
        if show:
            output.show_window()
        else:
            output.save(figure, given.save, source)


def _fail(message: str, code: int) -> int:
    print(f"{PROGRAM}: error: {one_line(message)}", file=sys.stderr)
    return code


def _number(text: str) -> float:
    value = float(text)
    if value != value:
        raise argparse.ArgumentTypeError("not a number")
    return value


def _period(text: str) -> float:
    value = _number(text)
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"'{text}' is not a time above 0")
    return value


def _size(text: str) -> tuple[float, float]:
    try:
        width, height = (float(part) for part in text.lower().split("x"))
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not WIDTHxHEIGHT in cm") from None
    if not all(SIZES[0] <= length <= SIZES[1] for length in (width, height)):
        raise argparse.ArgumentTypeError(f"'{text}': width and height must be {SIZES[0]:g} to {SIZES[1]:g} cm")
    return width, height


def _dpi(text: str) -> int:
    value = int(text) if text.isdecimal() else 0
    if not RESOLUTIONS[0] <= value <= RESOLUTIONS[1]:
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number from {RESOLUTIONS[0]} to {RESOLUTIONS[1]}")
    return value


if __name__ == "__main__":
    sys.exit(main())
