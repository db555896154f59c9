"""Files of ``razy-follow``: branches of periodic motions over a parameter, and the points at which they change kind."""

from dataclasses import dataclass

import h5py
import numpy as np
from numpy.typing import NDArray

from razy.errors import ResultError
from razy.read.extrema import ExtremaFile
from razy.read.file import Quantity, choose, quantity_of, text


@dataclass(frozen=True)
class Special:
    """Special points of all branches; all arrays have shape (special points,).

    Attributes
    ----------
    label
        ``LP`` fold, ``PD`` period doubling, and so on; see the file format.
    parameter
        Value of the parameter, in its units.
    branch
        Number of the branch, from 1.
    point
        Which of the motions it is, counted from 0.
    contact
        The contact that it is about; empty where none.
    error
        How far the parameter may be off by the errors of a Runge-Kutta method; NaN: not known, 0: by rounding only.
    """

    label: NDArray[np.str_]
    parameter: NDArray[np.float64]
    branch: NDArray[np.int64]
    point: NDArray[np.int64]
    contact: NDArray[np.str_]
    error: NDArray[np.float64]


@dataclass(frozen=True)
class Curves:
    """Curves of special points over two parameters.

    Attributes
    ----------
    label, contact, multiplicity
        Kind of the points, the contact that they are about, periods of the excitation in a motion, shape (curves,).
    curve
        Number of the curve of each point, from 1, shape (points,).
    parameters, quantities, places
        Names, descriptions and values of both parameters; values have shape (points,).
    junction, junctions
        Places where two things happen at once: label, and values of both parameters.
    """

    label: NDArray[np.str_]
    contact: NDArray[np.str_]
    multiplicity: NDArray[np.int64]
    curve: NDArray[np.int64]
    parameters: tuple[str, ...]
    quantities: tuple[Quantity, ...]
    places: tuple[NDArray[np.float64], ...]
    junction: NDArray[np.str_]
    junctions: tuple[NDArray[np.float64], ...]


@dataclass(frozen=True)
class Samples:
    """What was seen at the values of the parameter at which all motions were looked for.

    Attributes
    ----------
    parameter, lyapunov
        Value of the parameter, in its units; largest Lyapunov exponent of the machine's own motion there, 1/s; shape
        (samples,) both.
    unsettled
        Starts that settle to no periodic motion, shape (samples,).
    sample, branch, starts
        Of each motion that starts settle to: row of the sample, from 0, number of the branch, number of starts;
        shape (motions,).
    """

    parameter: NDArray[np.float64]
    lyapunov: NDArray[np.float64]
    unsettled: NDArray[np.int64]
    sample: NDArray[np.int64]
    branch: NDArray[np.int64]
    starts: NDArray[np.int64]


@dataclass(frozen=True)
class Sensitivities:
    """How special points move with values of the machine.

    Attributes
    ----------
    names, values
        The values, and what they are in the input, shape (values,).
    special
        Row of each point among the special points, from 0, shape (points,).
    slope, error
        Derivatives of the parameter by each value, and how far they may be off, shape (values, points); NaN where the
        point was not found again.
    """

    names: NDArray[np.str_]
    values: NDArray[np.float64]
    special: NDArray[np.int64]
    slope: NDArray[np.float64]
    error: NDArray[np.float64]


class FollowResult(ExtremaFile):
    """Periodic motions, in the order of their branches and along each; they are counted from 0."""

    @property
    def parameters(self) -> tuple[str, ...]:
        """Name of the parameter, such as ``rotation.speed_rpm``."""
        names = tuple(name for name in self._members("point", h5py.Dataset) if "." in name)
        if not names:
            raise ResultError(f"{self.path}: missing dataset '/point/<parameter>'")
        return names

    @property
    def columns(self) -> tuple[str, ...]:
        """What there is of each motion beside the parameter, one number each."""
        members = (name for name in self._members("point", h5py.Dataset) if name not in self.parameters)
        return tuple(name for name in members if self._dataset(f"point/{name}").ndim == 1)

    @property
    def n_points(self) -> int:
        """Number of motions."""
        return int(self._dataset(f"point/{self.parameters[0]}").shape[0])

    def parameter(self, name: str | None = None) -> Quantity:
        """Describe the parameter."""
        return quantity_of(self._dataset(f"point/{self._name(name)}"), self._name(name))

    def grid(self, name: str | None = None) -> NDArray[np.float64]:
        """Return the parameter's value at each motion, shape (points,), in the user's units."""
        return np.asarray(self._vector(f"point/{self._name(name)}", self.n_points)[()], dtype=np.float64)

    @property
    def states(self) -> NDArray[np.float64]:
        """State of each motion, displacements and then velocities, shape (points, 2 coordinates)."""
        return np.asarray(self._dataset("point/state")[()], dtype=np.float64)

    def column(self, name: str) -> NDArray:
        """Read one of `columns`, shape (points,)."""
        return self._vector(f"point/{name}", self.n_points)[()]

    @property
    def branch(self) -> NDArray[np.int64]:
        """Number of the branch of each motion, from 1, shape (points,)."""
        return self.column("branch").astype(np.int64)

    @property
    def multiplicity(self) -> NDArray[np.int64]:
        """Periods of the excitation in one of each motion, shape (points,)."""
        return self.column("multiplicity").astype(np.int64)

    @property
    def multiplier(self) -> NDArray[np.complex128]:
        """Floquet multipliers of each motion, shape (points, multipliers)."""
        item = self._dataset("point/multiplier")
        if item.ndim != 3 or item.shape[:2] != (self.n_points, 2):
            wanted = f"({self.n_points}, 2, multipliers)"
            raise ResultError(f"{self.path}: dataset 'point/multiplier' has shape {item.shape}, expected {wanted}")
        parts = np.asarray(item[()], dtype=np.float64)
        return parts[:, 0, :] + 1j * parts[:, 1, :]

    @property
    def samples(self) -> Samples | None:
        """What was seen beside the branches; None if one motion was followed."""
        if "lyapunov" not in self._members("sample", h5py.Dataset):
            return None
        count = self._dataset("sample/lyapunov").size
        settled = self._dataset("basin/branch").size
        return Samples(
            *(self._vector(f"sample/{name}", count)[()] for name in (self.parameters[0], "lyapunov", "unsettled")),
            *(self._vector(f"basin/{name}", settled)[()].astype(np.int64) for name in ("sample", "branch", "starts")),
        )

    @property
    def largest_multiplier(self) -> NDArray[np.float64]:
        """Absolute value of the largest multiplier of each motion, 0 where there is none, shape (points,)."""
        return np.abs(self.multiplier).max(axis=1, initial=0.0)

    @property
    def special(self) -> Special:
        """The special points."""
        label = self._texts("special/label")
        numbers = [self._vector(f"special/{name}", label.size)[()] for name in ("parameter", "branch", "point")]
        parameter, branch, point = np.asarray(numbers[0], dtype=np.float64), *(n.astype(np.int64) for n in numbers[1:])
        if point.size and not 0 <= point.min() <= point.max() < self.n_points:
            raise ResultError(f"{self.path}: dataset 'special/point' names motions that are not there")
        error = np.zeros(label.size)
        if "error" in self._members("special", h5py.Dataset):
            error = np.asarray(self._vector("special/error", label.size)[()], dtype=np.float64)
        return Special(label, parameter, branch, point, self._texts("special/contact"), error)

    @property
    def curves(self) -> Curves | None:
        """The curves over two parameters; None where one parameter was followed."""
        names = tuple(name for name in self._members("curve_point", h5py.Dataset) if "." in name)
        if not names:
            return None
        names = tuple(sorted(names, key=lambda name: name not in self.parameters))
        label, contact = self._texts("curve/label"), self._texts("curve/contact")
        curve = self._vector("curve_point/curve")[()].astype(np.int64)
        items = [self._vector(f"curve_point/{name}", curve.size) for name in names]
        return Curves(
            label,
            contact,
            self._vector("curve/multiplicity", label.size)[()].astype(np.int64),
            curve,
            names,
            tuple(quantity_of(item, name) for item, name in zip(items, names, strict=True)),
            tuple(np.asarray(item[()], dtype=np.float64) for item in items),
            self._texts("junction/label"),
            tuple(np.asarray(self._vector(f"junction/{name}")[()], dtype=np.float64) for name in names),
        )

    @property
    def sensitivities(self) -> Sensitivities | None:
        """How special points move; None where this was not asked for."""
        if "name" not in self._members("sensitivity", h5py.Dataset):
            return None
        names = self._texts("sensitivity/name")
        special = self._vector("sensitivity/special")[()].astype(np.int64)
        if special.size and not 0 <= special.min() <= special.max() < self.special.label.size:
            raise ResultError(f"{self.path}: dataset 'sensitivity/special' names points that are not there")
        slope, error = (
            np.array([self._vector(f"sensitivity/{name}{end}", special.size)[()] for name in names], dtype=np.float64)
            for end in ("", "_error")
        )
        values = np.asarray(self._vector("sensitivity/value", names.size)[()], dtype=np.float64)
        return Sensitivities(names, values, special, slope, error)

    @property
    def labels(self) -> NDArray[np.str_]:
        """Label of each motion, empty where nothing happens, shape (points,)."""
        special = self.special
        labels = np.full(self.n_points, "", dtype=special.label.dtype)
        labels[special.point] = special.label
        return labels

    @property
    def endings(self) -> tuple[str, ...]:
        """Why each branch ends, in words."""
        return tuple(self._texts("branch/ending").tolist())

    @property
    def parents(self) -> NDArray[np.int64]:
        """Number of the branch that each branch begins on, 0 where none, shape (branches,)."""
        return self._vector("branch/parent")[()].astype(np.int64)

    def _texts(self, path: str) -> NDArray[np.str_]:
        return np.asarray([text(item) for item in self._vector(path)[()]], dtype=np.str_)

    def _name(self, name: str | None) -> str:
        known = self.parameters
        return known[0] if name is None else choose(name.replace("%", "."), known, "parameter", self.path)
