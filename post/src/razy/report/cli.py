"""The command ``razy-report``."""

import os
import sys
import warnings
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import ExitStack
from io import BytesIO
from pathlib import Path

from matplotlib.figure import Figure

from razy.errors import Parser, ResultError, of_system, one_line
from razy.plot import PlotNote, PlotOptions, draw, draw_several
from razy.plot.style import look
from razy.programs import find_program
from razy.read import open_result
from razy.report.cases import Done, Workshop
from razy.report.manifest import FAILED, MISSED, Case, Item, Manifest, ManifestError, Plot, read_manifest
from razy.report.measure import measure, table_rows, verdict
from razy.report.page import Entry, counts, write_html, write_pdf
from razy.version import __version__

PROGRAM = "razy-report"
DPI = 200


def parser() -> Parser:
    """Return the parser of the command line."""
    result = Parser(
        prog=PROGRAM,
        description="Compute the cases of a manifest, draw and measure them, and write one page that says what agrees "
        "with the source: report.html and report.pdf.",
        epilog="Exit code: 0 done, 1 a case failed or a verdict is another than expected, 2 bad input or usage.",
        allow_abbrev=False,
    )
    result.add_argument(
        "manifest", metavar="MANIFEST.toml|FOLDER", type=Path, help="manifest, or folder of report.toml"
    )
    result.add_argument("--output", metavar="FOLDER", type=Path, default=Path("report"), help="folder (%(default)s)")
    result.add_argument("--programs", metavar="FOLDER", type=Path, help="folder of razy-run and the others")
    result.add_argument(
        "--only", metavar="NAME", action="append", default=[], help="only this item; repeat for several"
    )
    result.add_argument(
        "--jobs", metavar="N", type=int, default=os.cpu_count() or 1, help="cases at a time (%(default)s)"
    )
    result.add_argument("--quick", action="store_true", help="take the options 'quick' of the cases: coarser, faster")
    result.add_argument("--version", action="version", version=f"{PROGRAM} {__version__}")
    return result


def main(arguments: list[str] | None = None) -> int:
    """Run the command; return its exit code."""
    given = parser().parse_args(arguments)
    try:
        manifest = read_manifest(given.manifest)
        items = _chosen(manifest, given.only, given.quick)
        workshop = Workshop(given.output / "cases", _programs(given.programs), manifest.folder, given.quick)
        _check(items, workshop, max(given.jobs, 1))
    except (ResultError, OSError) as cause:
        error = of_system(cause) if isinstance(cause, OSError) else cause
        for line in str(error).splitlines():
            print(f"{PROGRAM}: error: {one_line(line)}", file=sys.stderr)
        return error.exit_code
    try:
        entries = _make(items, workshop, max(given.jobs, 1))
        write_html(manifest, entries, given.output / "report.html")
        write_pdf(manifest, entries, given.output / "report.pdf")
    except (ResultError, OSError) as cause:
        error = of_system(cause) if isinstance(cause, OSError) else cause
        print(f"{PROGRAM}: error: {one_line(str(error))}", file=sys.stderr)
        return error.exit_code
    print(f"{counts(entries)}: {given.output / 'report.html'}, {given.output / 'report.pdf'}")
    bad = [entry for entry in entries if entry.turned or entry.verdict in (MISSED, FAILED)]
    for entry in bad:
        expected = f", expected {entry.item.expected}" if entry.turned else ""
        print(f"{entry.item.name}: {entry.verdict}{expected} {entry.reasons}".rstrip(), file=sys.stderr)
    return 1 if bad else 0


def _chosen(manifest: Manifest, names: list[str], quick: bool) -> list[Item]:
    known = {item.name: item for item in manifest.item}
    for name in names:
        if name not in known:
            raise ManifestError(f"--only {name}: no such item (has: {', '.join(known)})")
    return [known[name] for name in names] if names else [item for item in manifest.item if not (quick and item.slow)]


def _programs(given: Path | None) -> Path:
    """Return the folder of the programs: as given, beside this command as it was called, or where `razy.run` looks."""
    beside = Path(sys.argv[0]).absolute().parent
    if given is None and "RAZY_BIN" not in os.environ and (beside / "razy-run").is_file():
        return beside
    return find_program("razy-run", given).parent


def _check(items: list[Item], workshop: Workshop, jobs: int) -> None:
    # Items share cases; each is checked once, under the name of the first item.
    cases: dict[tuple[str, ...], tuple[Item, Case]] = {}
    for item in items:
        for case in item.case:
            cases.setdefault((case.input, case.program, *workshop.options(case)), (item, case))
    with ThreadPoolExecutor(jobs) as pool:
        said = pool.map(lambda pair: workshop.check(pair[1]), cases.values())
        problems = [f"item '{item.name}': {line}" for (item, _), line in zip(cases.values(), said, strict=True) if line]
    if problems:
        raise ManifestError("\n".join(dict.fromkeys(problems)))


def _make(items: list[Item], workshop: Workshop, jobs: int) -> list[Entry]:
    cases = [case for item in items for case in item.case]
    count = len({workshop.key(case) for case in cases})
    finished = 0

    def show(case, done: Done) -> None:
        nonlocal finished
        finished += 1
        how = "kept" if done.kept else f"{done.seconds:.1f} s"
        print(f"[{finished}/{count}] {case.input} {' '.join(case.set)}: {done.problem or how}", flush=True)

    done = workshop.compute_all(cases, jobs, show)
    entries = []
    by_name = [{case.name: done[case] for case in item.case} for item in items]
    # Pictures take longer than many a computation, and matplotlib does not draw in threads.
    with ProcessPoolExecutor(jobs) as pool:
        for entry in pool.map(_entry, items, by_name, [workshop.folder.parent / "images"] * len(items)):
            entries.append(entry)
            print(f"{entry.item.name}: {entry.verdict} {entry.reasons}".rstrip(), flush=True)
    return entries


def _entry(item: Item, done: Mapping[str, Done], images: Path) -> Entry:
    entry = Entry(item, "", [], seconds=sum(one.seconds for one in done.values()))
    entry.problems = [f"{name or item.case[0].input}: {one.problem}" for name, one in done.items() if one.problem]
    if not entry.problems:
        entry.measured = measure(item, done)
        for plot in item.plot:
            try:
                entry.pictures.append(_picture(item, plot, done))
                if plot.save:
                    images.mkdir(parents=True, exist_ok=True)
                    (images / plot.save).write_bytes(entry.pictures[-1])
            except Exception as cause:
                entry.problems.append(f"picture: {cause}")
        for table in item.table:
            try:
                with open_result(done[item.case_called(table.case).name].file) as result:
                    head = [*table.heads, "place"] if table.number else list(table.heads)
                    entry.tables.append([head, *table_rows(table, result.file)])
            except (ResultError, LookupError, TypeError, ValueError) as cause:
                entry.problems.append(f"table: {cause}")
    for one in list(done.values())[:1]:
        if not one.problem:
            with open_result(one.file) as result:
                entry.commit = result.git_commit[:12]
    entry.verdict = verdict(item, list(entry.measured), entry.problems)
    return entry


def _picture(item: Item, plot: Plot, done: Mapping[str, Done]) -> bytes:
    """Draw a picture; return the PNG file."""
    options = PlotOptions(
        observables=plot.observables, coordinates=plot.coordinates, start=plot.start, stop=plot.stop,
        title="" if plot.title is None else plot.title, size=plot.size, swap=plot.swap,
    )  # fmt: skip
    figure = Figure(dpi=DPI)
    with ExitStack() as stack, warnings.catch_warnings():
        warnings.simplefilter("ignore", PlotNote)
        names = plot.cases or (item.case[0].name,)
        results = [stack.enter_context(open_result(done[name].file)) for name in names]
        if len(results) == 1:
            draw(results[0], figure, options, plot.kind or None)
        else:
            draw_several(results, figure, options, plot.kind or None, plot.labels, plot.arrange)
        written = BytesIO()
        with look():
            figure.savefig(written, format="png", dpi=DPI)
    return written.getvalue()


if __name__ == "__main__":
    sys.exit(main())
