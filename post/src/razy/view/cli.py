"""The command ``razy-view``: a sweep's diagram in a browser, with the motion at each point that is clicked."""

import argparse
import signal
import sys
from pathlib import Path

from razy.errors import Parser, ResultError, one_line
from razy.target import check_output, write_text
from razy.version import __version__
from razy.view.sweep import PROGRAM, Sweep


def parser() -> Parser:
    """Return the parser of the command line."""
    result = Parser(
        prog=PROGRAM,
        description="Show a sweep in a browser: a click on its diagram computes the motion there and shows it, "
        "the last two beside each other.",
        epilog="Exit code: 0 done, 2 bad input or usage, 1 anything else.",
        allow_abbrev=False,
    )
    result.add_argument("file", metavar="FILE.h5", type=Path, help="file of razy-sweep")
    result.add_argument(
        "--at", metavar="X[,Y]", action="append", default=[], help="value of the parameter(s); repeat for several"
    )
    result.add_argument("--save", metavar="PAGE.html", type=Path, help="write a page to send to others, and stop")
    result.add_argument(
        "--input", metavar="CASE.nml", type=Path, help="write the input of the motion --at one point, and stop"
    )
    result.add_argument("--force", action="store_true", help="overwrite the page or the input if it exists")
    result.add_argument("--programs", metavar="FOLDER", type=Path, help="folder of razy's programs")
    result.add_argument("--port", metavar="N", type=int, default=0, help="port of the page; by default a free one")
    result.add_argument("--no-browser", action="store_true", help="only print the address")
    result.add_argument("--version", action="version", version=f"{PROGRAM} {__version__}")
    return result


def main(arguments: list[str] | None = None) -> int:
    """Run the command; return its exit code."""
    given = parser().parse_args(arguments)
    # Whoever ends it, what it computed goes.
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, _interrupt)
    try:
        _view(given)
    except ResultError as error:
        return _fail(str(error), error.exit_code)
    except KeyboardInterrupt:
        return 0
    except Exception as error:
        return _fail(f"{type(error).__name__}: {error}", 1)
    return 0


def _interrupt(*_: object) -> None:
    raise KeyboardInterrupt


def _view(given: argparse.Namespace) -> None:
    sweep = Sweep(given.file, given.programs)
    points = [sweep.nearest(_values(text)) for text in given.at]
    target = given.input or given.save
    if target is not None:
        check_output(target, [given.file], given.force)
        if not target.parent.is_dir():
            raise ResultError(f"{target}: no folder '{target.parent}'")
    if given.input is not None:
        if len(points) != 1 or given.save is not None:
            raise ResultError("--input goes with one --at, and without --save")
        write_text(target, sweep.motion(points[0]).case)
        return
    try:
        from razy.view import page
    except ImportError as cause:
        raise ResultError(f"{PROGRAM} needs the package bokeh (pip install bokeh): {cause}") from cause
    if given.save is None:
        page.serve(sweep, points, given.port, not given.no_browser)
    else:
        write_text(target, page.static(sweep, points))


def _values(text: str) -> list[float]:
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise ResultError(f"--at {text}: a number, or two with a comma between") from None


def _fail(message: str, code: int) -> int:
    print(f"{PROGRAM}: error: {one_line(message)}", file=sys.stderr)
    return code


if __name__ == "__main__":
    sys.exit(main())
