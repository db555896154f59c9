"""The commands ``razy-merge``, ``razy-csv`` and ``razy-export``."""

import sys
from collections.abc import Callable
from pathlib import Path

from razy.errors import Parser, ResultError, one_line
from razy.read import FollowResult, SweepResult, open_result
from razy.read.file import making_sense_of
from razy.target import check_output
from razy.tools.export import export
from razy.tools.merge import merge
from razy.tools.table import write_extrema, write_points
from razy.version import __version__


def merge_main(arguments: list[str] | None = None) -> int:
    """Run ``razy-merge``; return its exit code."""
    parser = new_parser("razy-merge", "Make one file of sweeps of neighbouring ranges of a parameter.")
    parser.add_argument("files", metavar="FILE.h5", type=Path, nargs="+", help="files of razy-sweep, in any order")
    parser.add_argument("--output", metavar="FILE.h5", type=Path, required=True, help="file to write")
    given = parser.parse_args(arguments)
    return run_command(parser.prog, lambda: f"{given.output}: {merge(given.files, given.output, given.force)} points")


def csv_main(arguments: list[str] | None = None) -> int:
    """Run ``razy-csv``; return its exit code."""
    parser = new_parser(
        "razy-csv", "Write a sweep or branches as comma-separated text: points, or an observable's extrema."
    )
    parser.add_argument("file", metavar="FILE.h5", type=Path, help="file of razy-sweep or razy-follow")
    parser.add_argument("--observable", metavar="NAME", help="its extrema; without it the points")
    parser.add_argument("--output", metavar="FILE.csv", type=Path, help="file to write (default: FILE.csv)")
    given = parser.parse_args(arguments)

    def export() -> str:
        target = given.output or Path(given.file.with_suffix(".csv").name)
        check_output(target, [given.file], given.force)
        with open_result(given.file) as result, making_sense_of(given.file):
            if not isinstance(result, SweepResult | FollowResult):
                raise ResultError(f"{given.file}: not a file of razy-sweep or razy-follow")
            if given.observable is None:
                return f"{target}: {write_points(result, target)} points"
            return f"{target}: {write_extrema(result, given.observable, target)} extrema"

    return run_command(parser.prog, export)


def export_main(arguments: list[str] | None = None) -> int:
    """Run ``razy-export``; return its exit code."""
    parser = new_parser("razy-export", "Write a result for other programs, or the shapes of a rotor as they move.")
    parser.add_argument("file", metavar="FILE.h5", type=Path, help="result file")
    parser.add_argument(
        "--output", metavar="FILE", type=Path, required=True,
        help=".mat (all results), .vtk, .vtu, .xdmf (shapes of rotors), .gif, .html (a shape or motion, animated)",
    )  # fmt: skip
    parser.add_argument("--mode", metavar="N", type=int, default=1, help="mode that is animated (%(default)s)")
    parser.add_argument("--from", dest="start", metavar="S", type=float, help="of a motion: first time, s")
    parser.add_argument("--to", dest="stop", metavar="S", type=float, help="of a motion: last time, s")
    given = parser.parse_args(arguments)

    def export_it() -> str:
        check_output(given.output, [given.file], given.force)
        with open_result(given.file) as result, making_sense_of(given.file):
            return f"{given.output}: {export(result, given.output, given.mode, given.start, given.stop)}"

    return run_command(parser.prog, export_it)


def new_parser(name: str, does: str) -> Parser:
    """Return the parser of a command that writes a file."""
    parser = Parser(
        prog=name,
        description=does,
        epilog="Exit code: 0 done, 2 bad input or usage, 1 anything else.",
        allow_abbrev=False,
    )
    parser.add_argument("--force", action="store_true", help="overwrite the output if it exists")
    parser.add_argument("--version", action="version", version=f"{name} {__version__}")
    return parser


def run_command(name: str, work: Callable[[], str]) -> int:
    """Do the work of a command, say what was written; return the exit code."""
    try:
        print(f"wrote {work()}", file=sys.stderr)
    except ResultError as error:
        print(f"{name}: error: {one_line(str(error))}", file=sys.stderr)
        return error.exit_code
    except Exception as error:
        print(f"{name}: error: {type(error).__name__}: {one_line(str(error))}", file=sys.stderr)
        return 1
    return 0
