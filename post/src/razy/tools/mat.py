"""Result files as MATLAB's version 7.3, which is HDF5 with a header and classes of its own.

Groups become structures, arrays have the same shape as here, lists of texts become cell arrays. The structure ``units``
has the units of what has some, ``about`` the attributes of the file.
"""

import re
from pathlib import Path

import h5py
import numpy as np

from razy.read import ResultFile
from razy.read.file import check_storage, dimension_only, text
from razy.target import replacing_hdf5

LONGEST_NAME = 63


def write_mat(result: ResultFile, target: Path) -> int:
    """Write all datasets of a result; return their number."""
    words = b"MATLAB 7.3 MAT-file, written by razy, HDF5 schema 1.00 ."
    with replacing_hdf5(target, words.ljust(116) + bytes(8) + b"\x00\x02IM") as file:
        count = _copy(result.file, file, _structure(file, "units"))
        about = _structure(file, "about")
        for name, value in result.attributes().items():
            _write(about, _name(name, about), value)
    return count


def _copy(source: h5py.Group, target: h5py.Group, units: h5py.Group) -> int:
    count = 0
    for key, item in source.items():
        name = _name(key, target)
        if isinstance(item, h5py.Group):
            count += _copy(item, _structure(target, name), _structure(units, name))
        elif not dimension_only(item):
            check_storage(item)
            _write(target, name, _plain(item))
            unit = text(item.attrs.get("units", "1"))
            if unit != "1":
                _write(units, name, unit)
            count += 1
    return count


def _plain(item: h5py.Dataset) -> np.ndarray | list[str] | str:
    if h5py.check_string_dtype(item.dtype) is None:
        return np.asarray(item[()])
    texts = [text(value) for value in np.atleast_1d(item.asstr()[()])]
    return texts if item.ndim else texts[0]


def _structure(group: h5py.Group, name: str) -> h5py.Group:
    made = group.create_group(name)
    made.attrs["MATLAB_class"] = np.bytes_("struct")
    return made


def _write(group: h5py.Group, name: str, value: np.ndarray | list[str] | str) -> None:
    if isinstance(value, list):
        _write_cells(group, name, value)
        return
    letters = isinstance(value, str)
    array = np.array([ord(letter) for letter in value], dtype=np.uint16) if letters else np.atleast_1d(value)
    # MATLAB reads the dimensions in the opposite order; a vector is a column, a text a row.
    shape = (1, array.size) if letters else array.shape if array.ndim > 1 else (array.size, 1)
    if array.size == 0:
        made = group.create_dataset(name, data=np.array(shape, dtype=np.uint64))
        made.attrs["MATLAB_empty"] = np.uint8(1)
    else:
        made = group.create_dataset(name, data=array.reshape(shape).T)
    made.attrs["MATLAB_class"] = np.bytes_(
        "char" if letters else {"float64": "double"}.get(array.dtype.name, array.dtype.name)
    )
    if letters:
        made.attrs["MATLAB_int_decode"] = np.int32(2)


def _write_cells(group: h5py.Group, name: str, texts: list[str]) -> None:
    store = group.file.require_group("#refs#")
    references = []
    for value in texts:
        key = f"t{len(store)}"
        _write(store, key, value)
        references.append(store[key].ref)
    made = group.create_dataset(name, (1, len(texts)), dtype=h5py.ref_dtype)
    made[0] = references
    made.attrs["MATLAB_class"] = np.bytes_("cell")


def _name(key: str, group: h5py.Group) -> str:
    """Return a name that MATLAB takes and that is free: ``rotation.speed_rpm`` becomes ``rotation_speed_rpm``."""
    name = re.sub(r"\W+", "_", key, flags=re.ASCII).strip("_") or "x"
    name = (name if name[0].isalpha() else f"x{name}")[: LONGEST_NAME - 3]
    free, number = name, 1
    while free in group:
        number += 1
        free = f"{name}_{number}"
    return free
