"""Result files of razy-modes: natural frequencies and shapes, and for rotors eigenvalues over the speed."""

import h5py
import numpy as np
from numpy.typing import NDArray

from razy.errors import ResultError
from razy.read.file import Quantity, ResultFile, quantity_of, text


class ModesResult(ResultFile):
    """Result of razy-modes; all arrays are in the units of the file."""

    @property
    def is_campbell(self) -> bool:
        """Whether eigenvalues were followed over the speed."""
        return "branch" in self.file

    @property
    def natural_frequency(self) -> NDArray[np.float64]:
        """Undamped frequencies at rest, Hz, ascending, shape (modes,)."""
        return self._read("natural_frequency")

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates."""
        return tuple(text(name) for name in self._vector("coordinate")[()])

    @property
    def shape(self) -> NDArray[np.float64]:
        """Undamped shapes at rest, shape (modes, coordinates)."""
        values = self._read("shape")
        if values.shape != (self.natural_frequency.size, len(self.coordinates)):
            raise ResultError(f"{self.path}: dataset 'shape' has shape {values.shape}, expected (modes, coordinates)")
        return values

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
    def stable(self) -> NDArray[np.float64]:
        """1 stable, 0 unstable, -1 undecided, 2 neutral (everywhere without damping), shape (speeds, modes)."""
        return self._table("stable") if "stable" in self.file else np.full(self.frequency.shape, 2.0)

    @property
    def critical(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Critical speeds, rad/s, their excitation orders, and frequencies, Hz."""
        return self._read("critical_speed"), self._read("critical_order"), self._read("critical_frequency")

    @property
    def stability_limit(self) -> float:
        """Speed above which motion grows, rad/s; NaN if there is none."""
        return float(self._read("stability_limit"))

    @property
    def response_observables(self) -> tuple[str, ...]:
        """Names of the observables whose linear response was found; empty without ``&response``."""
        return self._members("response/phasor", h5py.Dataset)

    @property
    def response_parameter(self) -> Quantity:
        """The parameter over which the response was found."""
        item = self._vector("response/parameter")
        return quantity_of(item, quantity_of(item, "").long_name)

    @property
    def response_grid(self) -> NDArray[np.float64]:
        """Its values, shape (points,)."""
        return self._read("response/parameter")

    def phasor(self, observable: str) -> NDArray[np.complex128]:
        """Read phasors, Re(phasor exp(i omega t)), shape (points, tones)."""
        values = self._read(f"response/phasor/{observable}")
        if values.ndim != 3 or values.shape[0] != self.response_grid.size or values.shape[2] != 2:
            raise ResultError(f"{self.path}: the response of '{observable}' has shape {values.shape}")
        return values[..., 0] + 1j * values[..., 1]

    def phasor_quantity(self, observable: str) -> Quantity:
        """Describe an observable whose response was found."""
        return quantity_of(self._dataset(f"response/phasor/{observable}"), observable)

    def response_peaks(self, observable: str, tone: int) -> list[tuple[float, float, float]]:
        """Return parameter, amplitude and amplification factor of each peak; tones are counted from 0."""
        names = [text(item) for item in self._vector("response/peak_observable")[()]]
        numbers = [self._read(f"response/{name}") for name in
                   ("peak_tone", "peak_parameter", "peak_amplitude", "amplification_factor")]  # fmt: skip
        rows = zip(names, *numbers, strict=True)
        return [tuple(row[2:]) for row in rows if row[0] == observable and row[1] == tone + 1]

    def _table(self, name: str) -> NDArray[np.float64]:
        values = self._read(name)
        if values.ndim != 2 or values.shape[0] != self.speed.size:
            raise ResultError(f"{self.path}: dataset '{name}' has shape {values.shape}, expected (speeds, modes)")
        return values

    def _read(self, name: str) -> NDArray[np.float64]:
        return np.asarray(self._dataset(name)[()], dtype=np.float64)
