"""Arrays that are read from a file when they are looked at: the variables of `ResultFile.to_xarray`."""

from collections.abc import Callable
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray
from xarray.backends import BackendArray
from xarray.core import indexing


class LazyArray(BackendArray):
    """An array whose part `key` (integers, slices, one array of integers) is what `read` returns."""

    def __init__(self, shape: tuple[int, ...], dtype: np.dtype, read: Callable[[tuple], Any]) -> None:
        self.shape, self.dtype, self.read = shape, np.dtype(dtype), read

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:
        """Read the part `key`."""
        return indexing.explicit_indexing_adapter(
            key, self.shape, indexing.IndexingSupport.OUTER_1VECTOR, lambda part: np.asarray(self.read(part))
        )


def stored(item: h5py.Dataset) -> Any:
    """Return a dataset as data of an `xarray.Variable`; the file is opened anew for each reading."""
    path, name, is_text = item.file.filename, item.name, h5py.check_string_dtype(item.dtype) is not None
    if item.nbytes == 0 or item.ndim == 0 or is_text:
        # Nothing to be gained, and h5py reads text as bytes.
        return item.asstr()[()] if is_text else item[()]

    def read(part: tuple) -> Any:
        with h5py.File(path, "r") as file:
            return file[name][part]

    return indexing.LazilyIndexedArray(LazyArray(item.shape, item.dtype, read))


def repeated(values: NDArray, offset: NDArray[np.int64]) -> Any:
    """Return ``values`` (points,), each as often as ``offset`` (points + 1,) rises there, made when looked at."""
    count = int(offset[-1])

    def read(part: tuple) -> Any:
        (key,) = part
        rows = np.arange(*key.indices(count)) if isinstance(key, slice) else np.asarray(key)
        return values[np.searchsorted(offset, rows, side="right") - 1]

    return indexing.LazilyIndexedArray(LazyArray((count,), values.dtype, read))
