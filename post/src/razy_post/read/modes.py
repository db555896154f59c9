"""Result files of razy-modes: natural frequencies and shapes, and for rotors eigenvalues over the speed."""

import numpy as np
from numpy.typing import NDArray

from razy_post.errors import ResultError
from razy_post.read.file import ResultFile


class ModesResult(ResultFile):
    """Result of razy-modes; all arrays are in the units of the file."""

    @property
    def is_campbell(self) -> bool:
        """Whether eigenvalues were followed over the speed."""
        return "branch" in self.file

    @property
    def speed(self) -> NDArray[np.float64]:
        """Speeds, rad/s, ascending, shape (speeds,)."""
        return self._read("speed")

    @property
    def frequency(self) -> NDArray[np.float64]:
        """Frequencies in ascending order, Hz, shape (speeds, modes)."""
        return self._table("frequency")

    @property
    def eigenvalue(self) -> NDArray[np.complex128]:
        """Eigenvalues over the speed, in the order of `frequency`, 1/s, shape (speeds, modes)."""
        values = self._read("eigenvalue")
        if values.shape != (*self.frequency.shape, 2):
            raise ResultError(
                f"{self.path}: dataset 'eigenvalue' has shape {values.shape}, expected (speeds, modes, 2)"
            )
        return values[..., 0] + 1j * values[..., 1]

    @property
    def branch(self) -> NDArray[np.float64]:
        """Branch of each frequency, NaN where a speed has fewer modes, shape (speeds, modes)."""
        return self._table("branch")

    @property
    def direction(self) -> NDArray[np.float64]:
        """Direction of whirl, +1 forward to -1 backward, shape (speeds, modes)."""
        return self._table("direction")

    @property
    def critical(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Critical speeds, rad/s, their excitation orders, and frequencies, Hz."""
        return self._read("critical_speed"), self._read("critical_order"), self._read("critical_frequency")

    @property
    def stability_limit(self) -> float:
        """Speed above which motion grows, rad/s; NaN if there is none."""
        return float(self._read("stability_limit"))

    def _table(self, name: str) -> NDArray[np.float64]:
        values = self._read(name)
        if values.ndim != 2 or values.shape[0] != self.speed.size:
            raise ResultError(f"{self.path}: dataset '{name}' has shape {values.shape}, expected (speeds, modes)")
        return values

    def _read(self, name: str) -> NDArray[np.float64]:
        return np.asarray(self._dataset(name)[()], dtype=np.float64)
