"""Files of ``razy-sweep``: points over one or two parameters and the extrema found at each."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import h5py
import numpy as np
from numpy.typing import NDArray

from razy.errors import ResultError
from razy.read.extrema import ExtremaFile
from razy.read.file import Quantity, choose, meanings, quantity_of, text, text_list

if TYPE_CHECKING:
    import xarray


UP = 1
DOWN = -1


@dataclass(frozen=True)
class ExtremaTable:
    """Extrema of a sweep as rows; all arrays have shape (rows,), in the units of the file."""

    parameter: NDArray[np.float64]
    value: NDArray[np.float64]
    kind: NDArray[np.int8]


@dataclass(frozen=True)
class Basin:
    """The starts of one grid point; arrays have shape (starts,).

    Attributes
    ----------
    value
        For each number that varies its values, in the units of the file.
    attractor
        Number of the attractor each start leads to, 0 none that is periodic, -1 the motion failed.
    period
        Period of each attractor in periods of the excitation.
    """

    value: dict[str, NDArray[np.float64]]
    attractor: NDArray[np.int64]
    period: dict[int, int]


class SweepResult(ExtremaFile):
    """Result of a sweep; points are in grid order and counted from 0."""

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the swept parameters, such as ``rotation.speed_rpm``; the last one runs fastest."""
        names = self._members("axis", h5py.Dataset)
        status = self._find("point/status")
        order = [] if status is None else text(status.attrs.get("coordinates", "")).split()
        return tuple(sorted(names, key=lambda name: order.index(name) if name in order else len(order)))

    def parameter(self, name: str | None = None) -> Quantity:
        """Describe a swept parameter; the only one if no name is given."""
        name = self._parameter_name(name)
        return quantity_of(self._axis_data(name), name)

    def axis(self, name: str | None = None) -> NDArray[np.float64]:
        """Read the values of a swept parameter, shape (values on this axis,), in the user's units."""
        return np.asarray(self._axis_data(self._parameter_name(name))[()], dtype=np.float64)

    @property
    def n_points(self) -> int:
        """Number of points: those of the grid, once for each start and direction."""
        grid = self.n_grid * self.n_starts
        direction = self._find("point/direction")
        if direction is None:
            return grid
        if direction.shape not in ((grid,), (2 * grid,)):
            raise ResultError(
                f"{self.path}: dataset '/point/direction' has shape {direction.shape}, expected ({grid},)"
            )
        return int(direction.shape[0])

    @property
    def n_grid(self) -> int:
        """Number of points of the grid."""
        return int(np.prod([self._axis_data(name).shape[0] for name in self._require_parameters()]))

    @property
    def outer_parameter(self) -> str:
        """The parameter that runs slowest."""
        for name in self._require_parameters():
            if len(self.parameters) == 1:
                return name
            values = self._vector(f"point/{name}")[: self.n_grid]
            if values.size < 2 or values[0] == values[1]:
                return name
        return self.parameters[0]

    @property
    def n_starts(self) -> int:
        """Number of initial states of each grid point."""
        start = self._find("point/start")
        return 1 if start is None or start.shape[0] == 0 else int(start[()].max())

    @property
    def start_quantities(self) -> tuple[str, ...]:
        """Numbers of the initial state that vary, such as ``block.velocity``, those of displacements first."""
        names = [
            name.removeprefix("start.") for name in self._members("point", h5py.Dataset) if name.startswith("start.")
        ]
        return tuple(sorted(names, key=lambda name: (name.endswith(".velocity"), names.index(name))))

    def start_quantity(self, name: str) -> Quantity:
        """Describe a number of the initial state."""
        return quantity_of(self._vector(f"point/start.{name}", self.n_points), name)

    def basin(self, point: int) -> Basin:
        """Read where the starts of a grid point lead, counted from 0; of a sweep both ways those on the first way."""
        if not 0 <= point < self.n_grid:
            raise IndexError(f"grid point {point} of {self.n_grid}")
        part = slice(point, self.n_grid * self.n_starts, self.n_grid)
        value = {name: self._vector(f"point/start.{name}", self.n_points)[part] for name in self.start_quantities}
        offset = self._vector("attractor/offset")[point : point + 2]
        rows = slice(int(offset[0]), int(offset[1]))
        number, period = (self._vector(f"attractor/{name}")[rows] for name in ("number", "period"))
        attractor = np.asarray(self._vector("point/attractor", self.n_points)[part], dtype=np.int64)
        return Basin(value, attractor, dict(zip(number.tolist(), period.tolist(), strict=True)))

    @property
    def direction(self) -> NDArray[np.int8] | None:
        """Direction of the chain that each point belongs to, shape (points,); None where each point stands alone.

        `UP` where a motion started at the end of the one at the parameter before, `DOWN` at the end of the one after.
        """
        if self._find("point/direction") is None:
            return None
        return np.asarray(self._vector("point/direction", self.n_points)[()], dtype=np.int8)

    @property
    def status(self) -> NDArray[np.int64]:
        """Outcome of each point, shape (points,); 0 is success, and is assumed where the file has no status."""
        if self._find("point/status") is None:
            return np.zeros(self.n_points, dtype=np.int64)
        return np.asarray(self._vector("point/status", self.n_points)[()], dtype=np.int64)

    @property
    def status_meanings(self) -> dict[int, str]:
        """What the status values mean, as far as the file says."""
        item = self._find("point/status")
        return meanings(item) if item is not None else {}

    @property
    def events(self) -> NDArray[np.int64] | None:
        """Number of contact events at each point, shape (points,); None if the file has none."""
        return self._counter("events")

    @property
    def steps(self) -> NDArray[np.int64] | None:
        """Number of integration steps at each point, shape (points,); None if the file has none."""
        return self._counter("steps")

    @property
    def near_misses(self) -> NDArray[np.int64] | None:
        """Number of near misses at each point, shape (points,); None if the file has none."""
        return self._counter("near_misses")

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the single numbers of a point, such as ``events``: what ``/point`` has beside coordinates."""
        coordinates = {*self.parameters, "direction", "start", *(f"start.{name}" for name in self.start_quantities)}
        names, shape = self._members("point", h5py.Dataset), (self.n_points,)
        return tuple(name for name in names if name not in coordinates and self.file["point"][name].shape == shape)

    def column(self, name: str) -> NDArray:
        """Read one of `columns`, shape (points,)."""
        choose(name, self.columns, "column", self.path)
        return np.asarray(self._vector(f"point/{name}", self.n_points)[()])

    @property
    def period(self) -> NDArray[np.int64] | None:
        """Period of each motion in periods of the excitation, shape (points,); None if the file has none.

        0: not periodic within 32 periods; -1: not determined; -2: not settled.
        """
        return self._counter("period")

    @property
    def lyapunov(self) -> NDArray[np.float64] | None:
        """Lyapunov exponents of each motion, 1/s, descending, shape (points, exponents); None without them."""
        if "exponent" not in self._members("lyapunov", h5py.Dataset):
            return None
        item = self._dataset("lyapunov/exponent")
        if item.ndim != 2 or item.shape[0] != self.n_points:
            wanted = f"({self.n_points}, exponents)"
            raise ResultError(f"{self.path}: dataset 'lyapunov/exponent' has shape {item.shape}, expected {wanted}")
        return np.asarray(item[()], dtype=np.float64)

    @property
    def touched(self) -> dict[str, NDArray[np.bool_]] | None:
        """Whether each point touched a contact, shape (points,), by its name; None if the file has none."""
        bits = self._counter("touched")
        if bits is None:
            return None
        names = text_list(self._dataset("point/touched").attrs.get("names", ""))
        return {name: bits >> min(bit, 62) & 1 != 0 for bit, name in enumerate(names)}

    @property
    def contacts(self) -> tuple[str, ...]:
        """Names of the contacts whose statistics were recorded."""
        return self._members("contact", h5py.Group)

    @property
    def averages(self) -> tuple[str, ...]:
        """Names of the observables whose ``mean`` and ``rms`` were recorded."""
        return self._members("average", h5py.Group)

    def contact_value(self, contact: str, quantity: str) -> NDArray[np.float64]:
        """Read a statistic of a contact such as ``largest_force``, or ``mean`` of one of `averages`; (points,)."""
        return np.asarray(self._vector(self._contact_path(contact, quantity), self.n_points)[()], dtype=np.float64)

    def where_followed(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the values of the points, with NaN where the motion failed: what is there is of a part of it."""
        return np.where(self.status == 0, values, np.nan)

    def contact_quantity(self, contact: str, quantity: str) -> Quantity:
        """Describe a statistic of a contact, or of one of `averages`."""
        return quantity_of(self._dataset(self._contact_path(contact, quantity)), quantity)

    def _contact_path(self, contact: str, quantity: str) -> str:
        choose(contact, (*self.contacts, *self.averages), "contact", self.path)
        group = f"{'contact' if contact in self.contacts else 'average'}/{contact}"
        choose(quantity, self._members(group, h5py.Dataset), "quantity", self.path)
        return f"{group}/{quantity}"

    def within(self, start: float | None, stop: float | None) -> NDArray[np.bool_]:
        """Return which points have their parameter between `start` and `stop`, open where None, shape (points,)."""
        grid = self.grid()
        selected = np.isfinite(grid)
        selected &= grid >= start if start is not None else True
        selected &= grid <= stop if stop is not None else True
        return selected

    def table(self, observable: str, kind: int | None = None, parameter: str | None = None) -> ExtremaTable:
        """Read all extrema of an observable as rows (parameter, value, kind).

        Parameters
        ----------
        observable
            One of `observables`.
        kind
            +1 for maxima, -1 for minima only; both if it is left out.
        parameter
            One of `parameters`; may be left out when there is only one.
        """
        extrema = self.extrema(observable)
        read = extrema.all()
        at = np.repeat(self.grid(parameter), extrema.counts)
        keep = slice(None) if kind is None else read.kind == kind
        return ExtremaTable(at[keep], read.value[keep], read.kind[keep])

    def grid(self, parameter: str | None = None) -> NDArray[np.float64]:
        """Return a parameter's value at each point, shape (points,), in the user's units."""
        name = self._parameter_name(parameter)
        if len(self.parameters) == 1 and self._find(f"point/{name}") is None and self.direction is None:
            return self.axis(name)
        return np.asarray(self._vector(f"point/{name}", self.n_points)[()], dtype=np.float64)

    def to_xarray(self) -> "xarray.Dataset":
        """Return the whole file as an `xarray.Dataset`; extrema are read when they are looked at.

        Dimensions are ``point`` and, for each observable, ``<observable>_extremum``, and ``<observable>_strobe`` for
        its values once in each period; the coordinates carry the parameters of each, so that ``ds.groupby`` and
        ``ds.where`` work without the offsets.
        """
        import xarray

        from razy.read.lazy import repeated, stored

        coordinates: dict[str, tuple] = {
            name: ("point", self.grid(name), self.parameter(name).attributes()) for name in self.parameters
        }
        direction = self.direction
        if direction is not None:
            coordinates["direction"] = ("point", direction, {})
        variables: dict[str, tuple] = {"status": ("point", self.status)}
        for name in self.columns:
            described = quantity_of(self._dataset(f"point/{name}"), name).attributes()
            variables[name] = ("point", self.column(name), described)
        if self._find("point/start") is not None:
            coordinates["start"] = ("point", self._vector("point/start", self.n_points)[()], {})
            for name in self.start_quantities:
                item = self._vector(f"point/start.{name}", self.n_points)
                coordinates[f"start.{name}"] = ("point", item[()], self.start_quantity(name).attributes())
        for contact in (*self.contacts, *self.averages):
            for quantity in (
                ("mean", "rms") if contact in self.averages else self._members(f"contact/{contact}", h5py.Dataset)
            ):
                described = self.contact_quantity(contact, quantity).attributes()
                variables[f"{contact}.{quantity}"] = ("point", self.contact_value(contact, quantity), described)
        lists = [(name, self.extrema(name), f"{name}_extremum") for name in self.observables]
        for name, extrema, rows in lists + [(f"{n}_strobe", self.strobe(n), f"{n}_strobe") for n in self.strobes]:
            variables[name] = (rows, stored(extrema.data.value), extrema.quantity.attributes())
            if extrema.data.time is not None:
                variables[f"{name}_time"] = (rows, stored(extrema.data.time), {"units": "s"})
            if extrema.data.kind is not None:
                variables[f"{name}_kind"] = (rows, stored(extrema.data.kind))
            coordinates[f"{name}_point"] = (rows, repeated(np.arange(self.n_points), extrema.offset), {})
            for parameter in self.parameters:
                at = repeated(self.grid(parameter), extrema.offset)
                coordinates[f"{name}_{parameter}"] = (rows, at, self.parameter(parameter).attributes())
        for name, (along, *rest) in self._as_stored("attractor", "lyapunov").items():
            variables[name] = (["point" if each == "lyapunov.point" else each for each in along], *rest)
        return xarray.Dataset(variables, coordinates, attrs=self.attributes())

    def _require_parameters(self) -> tuple[str, ...]:
        if not self.parameters:
            raise ResultError(f"{self.path}: missing dataset '/axis/<parameter>'")
        return self.parameters

    def _parameter_name(self, name: str | None) -> str:
        known = self._require_parameters()
        if name is not None:
            return choose(name.replace("%", "."), known, "parameter", self.path)
        if len(known) > 1:
            raise ResultError(f"{self.path}: sweeps over several parameters, name one of: {', '.join(known)}")
        return known[0]

    def _axis_data(self, name: str) -> h5py.Dataset:
        return self._vector(f"axis/{name}")

    def _counter(self, name: str) -> NDArray[np.int64] | None:
        if self._find(f"point/{name}") is None:
            return None
        return np.asarray(self._vector(f"point/{name}", self.n_points)[()], dtype=np.int64)
