"""Where a command writes: never over what it reads, nor over what is no file."""

from pathlib import Path

from razy_post.errors import ResultError


def check_output(path: Path, inputs: list[Path], overwrite: bool) -> None:
    """Raise a `ResultError` if `path` is one of the inputs, is taken by what is no file, or is to be kept."""
    if any(path.exists() and source.exists() and path.samefile(source) for source in inputs):
        raise ResultError(f"{path}: is the file that is read")
    if path.is_symlink() or (path.exists() and not path.is_file()):
        raise ResultError(f"{path}: is a link, a folder or a device, not a file that can be replaced")
    if path.exists() and not overwrite:
        raise ResultError(f"{path}: exists already; --force overwrites it")
