"""Where a picture goes: into a file that appears complete or not at all, or into a window."""

import os
import sys
from io import BytesIO
from pathlib import Path

import matplotlib
from matplotlib.backend_bases import FigureCanvasBase
from matplotlib.figure import Figure

from razy.errors import ResultError
from razy.plot.style import look
from razy.target import check_output, write_bytes
from razy.version import __version__

WINDOW_DPI = 140


def check_target(path: Path, sources: list[Path], overwrite: bool) -> None:
    """Raise a `ResultError` if no picture can go to `path`: its suffix, its folder, what is there."""
    formats = FigureCanvasBase.get_supported_filetypes()
    suffix = path.suffix.lower().removeprefix(".")
    if suffix not in formats:
        raise ResultError(f"--save {path}: unknown kind of picture '{path.suffix}' (can: {', '.join(sorted(formats))})")
    check_output(path, sources, overwrite)
    if not path.parent.is_dir():
        raise ResultError(f"--save {path}: no folder '{path.parent}'")


def save(figure: Figure, path: Path, provenance: str) -> None:
    """Write a figure to `path`, replacing what is there, in the format of the suffix.

    Parameters
    ----------
    figure
        The finished picture.
    path
        File to write; see `check_target`.
    provenance
        What the picture shows, kept in the metadata of the formats that have some.
    """
    path = path.resolve()
    kind = path.suffix.lower().removeprefix(".")
    software = f"razy {__version__}"
    metadata = {
        "png": {"Software": software, "Source": provenance},
        "pdf": {"Creator": software, "Subject": provenance},
        "svg": {"Creator": software, "Description": provenance},
    }.get(kind)
    # A writer of matplotlib that fails half-way may end with another error than that of the disk.
    content = BytesIO()
    with look():
        figure.savefig(content, format=kind, dpi=figure.dpi, metadata=metadata)
    write_bytes(path, content.getvalue())


def new_window(title: str) -> Figure:
    """Return an empty figure in a window; a `ResultError` if there is no display or no toolkit for windows."""
    hint = "use --save FILE.png"
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise ResultError(f"no display to show the picture on: {hint}")
    from matplotlib import pyplot
    from matplotlib.backends.registry import BackendFilter, backend_registry

    try:
        figure = pyplot.figure(num=title, dpi=WINDOW_DPI)
    except ImportError as cause:
        raise ResultError(f"no window can be opened ({cause}): {hint}") from cause
    if matplotlib.get_backend().lower() not in backend_registry.list_builtin(BackendFilter.INTERACTIVE):
        raise ResultError(f"matplotlib has no toolkit for windows here (backend {matplotlib.get_backend()}): {hint}")
    return figure


def show_window() -> None:
    """Show the window until the user closes it."""
    from matplotlib import pyplot

    pyplot.show()
