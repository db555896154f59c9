"""Where a command writes: never over what it reads, nor over what is no file, and all or nothing."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from fcntl import LOCK_EX, LOCK_NB, LOCK_SH, flock
from io import FileIO
from pathlib import Path

import h5py

from razy.errors import ResultError, of_system

# HDF5 leaves room for what stands before it in powers of two from here.
HEAD = 512


def check_output(path: Path, inputs: list[Path], overwrite: bool) -> None:
    """Raise a `ResultError` if `path` is one of the inputs, is taken by what is no file, or is to be kept."""
    if any(path.exists() and source.exists() and path.samefile(source) for source in inputs):
        raise ResultError(f"{path}: is the file that is read")
    if path.is_symlink() or (path.exists() and not path.is_file()):
        raise ResultError(f"{path}: is a link, a folder or a device, not a file that can be replaced")
    if path.exists() and not overwrite:
        raise ResultError(f"{path}: exists already; --force overwrites it")


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a name that becomes `path` when all is written: a failure leaves nothing, or what was there."""
    begins, ends = f".{path.stem[:200]}.", f".partial{path.suffix}"
    partial = path.with_name(f"{begins}{os.getpid()}{ends}")
    try:
        with _taking_part(path.parent, begins, ends):
            yield partial
            partial.replace(path)
    except OSError as cause:
        if cause.errno is None:
            raise
        raise of_system(cause, path) from cause
    finally:
        partial.unlink(missing_ok=True)


@contextmanager
def _taking_part(folder: Path, begins: str, ends: str) -> Iterator[None]:
    """Hold the shared lock of those who write in a folder; who is alone there deletes what killed ones left."""
    try:
        lock = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    except OSError:
        # What is wrong with the folder is said by who writes there.
        yield
        return
    try:
        with suppress(OSError):
            flock(lock, LOCK_EX | LOCK_NB)
            for path in folder.iterdir():
                name = path.name
                if name.startswith(begins) and name.endswith(ends) and name[len(begins) : -len(ends)].isdigit():
                    path.unlink()
        with suppress(OSError):
            flock(lock, LOCK_SH)
        yield
    finally:
        os.close(lock)


def write_bytes(path: Path, content: bytes) -> None:
    """Write all of the content, or nothing."""
    with replacing(path) as partial:
        partial.write_bytes(content)


def write_text(path: Path, text: str) -> None:
    """Write all of a text, or nothing."""
    write_bytes(path, text.encode())


@contextmanager
def replacing_hdf5(path: Path, head: bytes = b"") -> Iterator[h5py.File]:
    """Yield an HDF5 file that becomes `path` when all is written; at most 512 bytes stand before it."""
    with replacing(path) as partial, partial.open("w+b", buffering=0) as raw:
        disk = _Disk(raw)
        with h5py.File(disk, "w", userblock_size=HEAD if head else 0) as file:
            yield file
        disk.seek(0)
        disk.write(head)
        if disk.problem is not None:
            raise disk.problem


class _Disk:
    """A file that HDF5 writes to and always closes: what cannot be written is kept as `problem`.

    HDF5 that fails to write what it still holds crashes when Python ends.
    """

    def __init__(self, raw: FileIO) -> None:
        self.problem: OSError | None = None
        self._raw = raw
        self.read, self.readinto, self.seek, self.tell, self.flush = (
            raw.read,
            raw.readinto,
            raw.seek,
            raw.tell,
            raw.flush,
        )

    def write(self, data: bytes) -> int:
        """Write all of the data, or nothing more once something failed."""
        left = memoryview(data)
        try:
            while left and self.problem is None:
                left = left[self._raw.write(left) :]
        except OSError as problem:
            self.problem = problem
        return len(data)

    def truncate(self, size: int) -> int:
        """Give the file a size."""
        try:
            return self._raw.truncate(size)
        except OSError as problem:
            self.problem = self.problem or problem
            return size
