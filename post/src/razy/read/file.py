"""What all result files have in common: root attributes, datasets with units, one-line errors."""

import difflib
import os
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import h5py
import numpy as np

from razy.errors import ResultError, excerpt

if TYPE_CHECKING:
    import xarray

# What the compression of HDF5 can come to; the programs compress nothing.
MOST_COMPRESSION = 1100


@dataclass(frozen=True)
class Quantity:
    """What a dataset holds: its name in the file, its units as written there, a name to read."""

    name: str
    units: str
    long_name: str

    def attributes(self) -> dict[str, str]:
        """Return the attributes that the dataset has in the file."""
        return {"units": self.units, "long_name": self.long_name}


def text(value: Any) -> str:
    """Return an attribute as text, whether stored with fixed or variable length, padded with blanks or not."""
    if isinstance(value, np.ndarray):
        return " ".join(text(item) for item in value.flat)
    if isinstance(value, h5py.Empty):
        return ""
    if isinstance(value, bytes):
        value = value.decode("utf-8", errors="surrogateescape")
    # What is no UTF-8 could neither be drawn nor printed.
    return str(value).encode("utf-8", "surrogateescape").decode("utf-8", "replace").rstrip("\0 ")


def text_list(value: Any) -> tuple[str, ...]:
    """Return an attribute as a tuple of names: an array of strings, or one string with commas between."""
    if isinstance(value, np.ndarray) and value.ndim > 0:
        return tuple(text(item) for item in value.flat)
    return tuple(name.strip() for name in text(value).split(","))


def meanings(item: h5py.Dataset) -> dict[int, str]:
    """Read what the values of a dataset mean from its attribute ``meanings``: ``0 = ok, 1 = ...``."""
    return _pairs(item.attrs.get("meanings", ""))


def meanings_of_each(item: h5py.Dataset) -> tuple[dict[int, str], ...]:
    """Read the same where the attribute has a text for each contact; of older files all have one."""
    value = item.attrs.get("meanings", "")
    return tuple(_pairs(each) for each in value.flat) if isinstance(value, np.ndarray) else (_pairs(value),)


def _pairs(value: object) -> dict[int, str]:
    pairs = re.findall(r"(-?\d+)\s*=\s*(.*?)\s*(?=[,;]\s*-?\d+\s*=|$)", text(value))
    return {int(number): words for number, words in pairs}


def branch_of(words: str) -> str:
    """Return the branch of a law that words mean, without the pairs of teeth in mesh."""
    return words.partition(", ")[0]


def open_hdf5(path: str | Path) -> h5py.File:
    """Open an HDF5 file for reading; what is wrong with the file is a `ResultError`."""
    path = Path(path)
    if path.is_dir():
        raise ResultError(f"{path}: is a folder, not a result file")
    if not path.exists():
        raise ResultError(f"{path}: no such file")
    if not h5py.is_hdf5(path):
        reason = "not an HDF5 file" if os.access(path, os.R_OK) else "may not be read"
        raise ResultError(f"{path}: {reason}")
    try:
        return h5py.File(path, "r")
    except OSError as cause:
        reason = (
            "another program is writing it" if isinstance(cause, BlockingIOError) else "damaged or incomplete HDF5 file"
        )
        raise ResultError(f"{path}: {reason} ({str(cause).splitlines()[0]})") from cause


@contextmanager
def making_sense_of(path: str | Path) -> Iterator[None]:
    """Turn what goes wrong inside into a `ResultError` that names the file: its data are not those of its program."""
    try:
        yield
    except ResultError:
        raise
    except Exception as cause:
        if isinstance(cause, OSError) and cause.errno is not None:
            # That of a file that is written.
            raise
        words = " ".join(f"{type(cause).__name__}: {cause}".split())[:200]
        raise ResultError(f"{path}: damaged, no sense can be made of its data ({words})") from cause


def check_storage(item: h5py.Dataset) -> None:
    """Raise a `ResultError` if a dataset claims to be larger than what the file holds can be, compressed or not."""
    stored = item.id.get_storage_size()
    if item.nbytes > MOST_COMPRESSION * min(stored, Path(item.file.filename).stat().st_size):
        raise ResultError(
            f"{item.file.filename}: dataset '{item.name}' is damaged: "
            f"its shape {item.shape} takes {item.nbytes} bytes, but {stored} are stored"
        )


def program_of(file: h5py.File) -> str:
    """Name the program that wrote the file."""
    if "program" not in file.attrs:
        raise ResultError(f"{file.filename}: not a razy result file (it has no root attribute 'program')")
    return text(file.attrs["program"])


def choose(wanted: str, known: Iterable[str], what: str, path: str) -> str:
    """Return `wanted` if it is known; otherwise raise a `ResultError` with the nearest name and all names."""
    known = tuple(known)
    if wanted in known:
        return wanted
    if not known:
        raise ResultError(f"{path}: no {what} '{excerpt(wanted)}': the file has none")
    near = difflib.get_close_matches(excerpt(wanted), known, n=1)
    hint = f"; did you mean '{near[0]}'?" if near else ""
    raise ResultError(f"{path}: no {what} '{excerpt(wanted)}'{hint} (the file has: {', '.join(known)})")


class ResultFile:
    """An open result file. Datasets are read when asked for, never before.

    Parameters
    ----------
    file
        Open HDF5 file, which this object then owns.
    """

    def __init__(self, file: h5py.File) -> None:
        self.file = file

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the file; what was read from it stays valid."""
        self.file.close()

    @property
    def path(self) -> str:
        """Name of the file as it was opened."""
        return self.file.filename

    @property
    def program(self) -> str:
        """Program that wrote the file, such as ``razy-sweep``."""
        return self._attribute("program")

    @property
    def title(self) -> str:
        """Title from the scene; empty if it has none."""
        return self._attribute("title")

    @property
    def input(self) -> str:
        """The effective input: a namelist with everything that was used."""
        return self._attribute("input")

    @property
    def razy_version(self) -> str:
        """Version of razy that wrote the file."""
        return self._attribute("razy_version")

    @property
    def git_commit(self) -> str:
        """Commit of razy that wrote the file."""
        return self._attribute("git_commit")

    def attributes(self) -> dict[str, str]:
        """Return all root attributes as text."""
        return {name: text(value) for name, value in self.file.attrs.items()}

    def to_xarray(self) -> "xarray.Dataset":
        """Return all datasets of the file as an `xarray.Dataset`; numbers are read when they are looked at.

        Variables are named by their paths in the file, ``reduction/error`` as ``reduction.error``, and have its units
        and long names; attributes are those of the file.
        """
        import xarray

        return xarray.Dataset(self._as_stored(), attrs=self.attributes())

    def _as_stored(self, *groups: str) -> dict[str, tuple]:
        """Return the variables of `to_xarray` as they stand in the file, of these groups or of all."""
        from razy.read.lazy import stored

        variables: dict[str, tuple] = {}

        def keep(name: str, item: h5py.Dataset | h5py.Group) -> None:
            if not isinstance(item, h5py.Dataset) or dimension_only(item):
                return
            if groups and name.split("/")[0] not in groups:
                return
            check_storage(item)
            dimensions = [_dimension(item, axis) for axis in range(item.ndim)]
            attributes = {key: text(item.attrs[key]) for key in item.attrs if key.islower()}
            variables[name.replace("/", ".")] = (dimensions, stored(item), attributes)

        self.file.visititems(keep)
        return variables

    def _attribute(self, name: str) -> str:
        return text(self.file.attrs[name]) if name in self.file.attrs else ""

    def _find(self, path: str) -> h5py.Dataset | None:
        item = self.file.get(path)
        if not isinstance(item, h5py.Dataset):
            return None
        check_storage(item)
        return item

    def _dataset(self, path: str) -> h5py.Dataset:
        item = self._find(path)
        if item is None:
            raise ResultError(f"{self.path}: missing dataset '{path}'")
        return item

    def _vector(self, path: str, length: int | None = None) -> h5py.Dataset:
        """Return a dataset of rank one, of the given length if one is given."""
        item = self._dataset(path)
        if item.ndim != 1 or (length is not None and item.shape[0] != length):
            wanted = "one dimension" if length is None else f"shape ({length},)"
            raise ResultError(f"{self.path}: dataset '{path}' has shape {item.shape}, expected {wanted}")
        return item

    def _members(self, path: str, kind: type) -> tuple[str, ...]:
        """Return the names of a group's datasets (or groups), without those that only name a dimension."""
        group = self.file.get(path)
        if not isinstance(group, h5py.Group):
            return ()
        return tuple(n for n, item in group.items() if isinstance(item, kind) and not dimension_only(item))


def quantity_of(item: h5py.Dataset, name: str) -> Quantity:
    """Describe a dataset called `name` by its attributes ``units`` and ``long_name``."""
    return Quantity(name, text(item.attrs.get("units", "")), text(item.attrs.get("long_name", "")) or name)


def _dimension(item: h5py.Dataset, axis: int) -> str:
    """Name a dimension by its scale, ``point/point`` as ``point``."""
    scales = item.dims[axis]
    if len(scales) == 0 and not (item.is_scale and item.ndim == 1):
        return f"{item.name[1:]}/{axis}".replace("/", ".")
    parts = (scales[0] if len(scales) else item).name.strip("/").split("/")
    return ".".join(parts[:-1] if parts[-1:] == parts[-2:-1] else parts)


def dimension_only(item: h5py.Dataset | h5py.Group) -> bool:
    """Return whether a dataset only names a dimension."""
    return text(item.attrs.get("NAME", "")).startswith("This is a netCDF dimension but not a netCDF variable")
