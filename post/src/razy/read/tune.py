"""Result files of razy-tune: objective and natural frequencies over the parameter, and the tuned value."""

import numpy as np
from numpy.typing import NDArray

from razy.errors import ResultError
from razy.read.file import Quantity, ResultFile, quantity_of, text


class TuneResult(ResultFile):
    """Result of a tuning; all arrays are in the units of the file."""

    def quantity(self, name: str) -> Quantity:
        """Describe a dataset, such as ``parameter``."""
        return quantity_of(self._dataset(name), name)

    @property
    def mode(self) -> str:
        """Which mode was tuned, in words."""
        return text(self._dataset("optimum").attrs.get("mode", ""))

    @property
    def parameter(self) -> NDArray[np.float64]:
        """Values of the parameter, ascending, shape (points,)."""
        return self._read("parameter")

    @property
    def objective(self) -> NDArray[np.float64]:
        """(1 - f/goal)² of the mode that was tuned, shape (points,)."""
        return self._read("objective", self.parameter.shape)

    @property
    def tuned_frequency(self) -> NDArray[np.float64]:
        """Natural frequency of the mode that was tuned, Hz, shape (points,)."""
        return self._read("tuned_frequency", self.parameter.shape)

    @property
    def tuned_place(self) -> NDArray[np.float64]:
        """Place in ascending order of the mode that was tuned, from 1, shape (points,)."""
        return self._read("tuned_place", self.parameter.shape)

    @property
    def frequency(self) -> NDArray[np.float64]:
        """Natural frequencies, each mode followed by its shape, Hz, shape (points, modes)."""
        values = self._read("frequency")
        if values.ndim != 2 or values.shape[0] != self.parameter.size:
            raise ResultError(f"{self.path}: dataset 'frequency' has shape {values.shape}, expected (points, modes)")
        return values

    @property
    def frequency_before(self) -> NDArray[np.float64]:
        """All natural frequencies with the value of the input, ascending, Hz."""
        return self._read("frequency_before")

    @property
    def frequency_after(self) -> NDArray[np.float64]:
        """All natural frequencies with the tuned value, ascending, Hz."""
        return self._read("frequency_after")

    @property
    def optimum(self) -> float:
        """The tuned value."""
        return float(self._read("optimum", ()))

    @property
    def reference(self) -> float:
        """The value of the input."""
        return float(self._read("reference", ()))

    @property
    def goal(self) -> float:
        """Natural frequency that was asked for, Hz."""
        return float(self._read("goal", ()))

    def _read(self, name: str, shape: tuple[int, ...] | None = None) -> NDArray[np.float64]:
        values = np.asarray(self._dataset(name)[()], dtype=np.float64)
        if shape is not None and values.shape != shape:
            raise ResultError(f"{self.path}: dataset '{name}' has shape {values.shape}, expected {shape}")
        return values
