"""Where a command writes: never over what it reads, nor over what is no file."""

import os
from pathlib import Path

from razy.errors import ResultError


def check_output(path: Path, inputs: list[Path], overwrite: bool) -> None:
    """Raise a `ResultError` if `path` is one of the inputs, is taken by what is no file, or is to be kept."""
    if any(path.exists() and source.exists() and path.samefile(source) for source in inputs):
        raise ResultError(f"{path}: is the file that is read")
    if path.is_symlink() or (path.exists() and not path.is_file()):
        raise ResultError(f"{path}: is a link, a folder or a device, not a file that can be replaced")
    if path.exists() and not overwrite:
        raise ResultError(f"{path}: exists already; --force overwrites it")


def write_text(path: Path, text: str) -> None:
    """Write a text beside `path` and rename it when complete, so that a failure leaves nothing, or what was there."""
    partial = path.with_name(f".{path.stem}.{os.getpid()}.partial{path.suffix}")
    try:
        partial.write_text(text, encoding="utf-8")
        partial.replace(path)
    except OSError as cause:
        raise ResultError(f"{path}: {cause.strerror}") from cause
    finally:
        partial.unlink(missing_ok=True)
