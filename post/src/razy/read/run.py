"""Files of ``razy-run``: one motion with its trajectory, observables, events and extrema."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import h5py
import numpy as np
from numpy.typing import NDArray

from razy.errors import ResultError
from razy.read.extrema import Extrema, ExtremaData
from razy.read.file import Quantity, ResultFile, choose, meanings_of_each, quantity_of, text_list

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class Events:
    """Contact events in the order of time; all arrays have shape (events,).

    Attributes
    ----------
    time
        Time in s.
    contact
        Number of the contact that changed, from 1; 0 where the file does not say.
    state
        Branch of its law that was entered, see `RunResult.state_meanings`; -1 where the file does not say.
    """

    time: NDArray[np.float64]
    contact: NDArray[np.int64]
    state: NDArray[np.int64]


class RunResult(ResultFile):
    """Result of one motion."""

    @property
    def has_trajectory(self) -> bool:
        """Whether the motion was stored over time, or extrema and events only."""
        return self._find("time") is not None

    @property
    def time(self) -> NDArray[np.float64]:
        """Stored times in s, shape (times,)."""
        return np.asarray(self._vector("time")[()], dtype=np.float64)

    @property
    def time_quantity(self) -> Quantity:
        """Describe the time."""
        return quantity_of(self._vector("time"), "time")

    @property
    def excitation_period(self) -> float | None:
        """Period of the excitation in s; None where there is none, or the file does not say."""
        item = self._find("outcome/excitation_period")
        return float(item[0]) or None if item is not None and item.size == 1 else None

    @property
    def fastest_excitation(self) -> float:
        """Largest frequency of the excitation in Hz; 0 where there is none, or the file does not say."""
        item = self._find("outcome/fastest_excitation")
        return float(item[0]) if item is not None and item.size == 1 else 0.0

    @property
    def rotation(self) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """Times, s, and the speeds of the rotation there, rad/s, linear between them; None where it does not change."""
        if self._find("rotation/speed") is None:
            return None
        return tuple(np.asarray(self._vector(f"rotation/{name}")[()], dtype=np.float64) for name in ("time", "speed"))

    @property
    def end(self) -> float:
        """Time in s that the motion reached."""
        item = self._find("outcome/time")
        if item is not None and item.size == 1:
            return float(item[0])
        times = [self.time if self.has_trajectory else np.zeros(0), self._vector("event/time")[()]]
        return max((float(part.max()) for part in times if part.size), default=0.0)

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates; ``q1``, ``q2``, ... where the file gives none."""
        state = self._find("state/displacement")
        if state is None:
            return ()
        names = text_list(state.attrs["names"]) if "names" in state.attrs else ()
        count = self._state("displacement").shape[1]
        return names if len(names) == count else tuple(f"q{index + 1}" for index in range(count))

    @property
    def observables(self) -> tuple[str, ...]:
        """Names of the observables stored over time."""
        return tuple(n for n in self._members("observable", h5py.Dataset) if not self.file[f"observable/{n}"].is_scale)

    def displacement(self, coordinate: str, part: slice = slice(None)) -> NDArray[np.float64]:
        """Read a coordinate over the times `part`, shape (times,)."""
        return self._column("displacement", coordinate, part)

    def velocity(self, coordinate: str, part: slice = slice(None)) -> NDArray[np.float64]:
        """Read the velocity of a coordinate over the times `part`, shape (times,)."""
        return self._column("velocity", coordinate, part)

    def observable(self, name: str, part: slice = slice(None)) -> NDArray[np.float64]:
        """Read an observable over the times `part`, shape (times,)."""
        return np.asarray(self._observable(name)[part], dtype=np.float64)

    def coordinate_quantity(self, name: str, of: str = "displacement") -> Quantity:
        """Describe a coordinate, or with ``of="velocity"`` its velocity."""
        index = self._index(name)
        state = self._state(of)
        shared = quantity_of(state, name).units
        each = text_list(state.attrs["coordinate_units"]) if "coordinate_units" in state.attrs else ()
        if len(each) == len(self.coordinates):
            return Quantity(name, each[index], name)
        return Quantity(name, "" if shared == "mixed" else shared, name)

    def observable_quantity(self, name: str) -> Quantity:
        """Describe an observable."""
        return quantity_of(self._observable(name), name)

    def window(self, start: float | None = None, stop: float | None = None) -> slice:
        """Return the stored times between `start` and `stop` (s, both included) as a slice."""
        time = self.time
        first = 0 if start is None else int(np.searchsorted(time, start, side="left"))
        last = time.size if stop is None else int(np.searchsorted(time, stop, side="right"))
        return slice(first, last)

    @property
    def events(self) -> Events | None:
        """Contact events; None if the file has none."""
        if self._find("event/time") is None:
            return None
        time = np.asarray(self._vector("event/time")[()], dtype=np.float64)
        return Events(time, self._event_data("contact", time.size, 0), self._event_data("state", time.size, -1))

    @property
    def contacts(self) -> tuple[str, ...]:
        """Names of the contacts, first the one that events number 1; empty if the file gives none."""
        item = self._find("event/contact")
        return text_list(item.attrs["names"]) if item is not None and "names" in item.attrs else ()

    def state_meanings(self, contact: int) -> dict[int, str]:
        """Return what the states of a contact, numbered from 1, mean, as far as the file says."""
        item = self._find("event/state")
        of_each = meanings_of_each(item) if item is not None else ()
        return of_each[contact - 1] if 1 <= contact <= len(of_each) else of_each[0] if len(of_each) == 1 else {}

    @property
    def extrema_observables(self) -> tuple[str, ...]:
        """Names of the observables whose extrema were recorded."""
        return self._members("extrema", h5py.Group)

    def extrema(self, observable: str) -> Extrema:
        """Read the extrema of an observable."""
        data = self._extrema_data(observable)
        return data.read(slice(0, len(data)))

    def extrema_quantity(self, observable: str) -> Quantity:
        """Describe an observable whose extrema were recorded."""
        return self._extrema_data(observable).quantity(observable)

    def to_xarray(self) -> "xarray.Dataset":
        """Return the whole file as an `xarray.Dataset`; numbers are read when they are looked at.

        Dimensions are ``time`` and ``coordinate``, ``event`` and, for each observable whose extrema were recorded,
        ``<observable>_extremum``, of values once in each period ``<observable>_strobe``; only those that the file has.
        """
        import xarray

        from razy.read.lazy import stored

        variables: dict[str, tuple] = {}
        coordinates: dict[str, tuple] = {}
        if self.has_trajectory:
            coordinates["time"] = ("time", self.time, {"units": self.time_quantity.units})
        for name in ("displacement", "velocity"):
            if self._find(f"state/{name}") is not None:
                item = self._state(name)
                # An observable may have the same name.
                free = f"state.{name}" if name in self.observables else name
                variables[free] = (("time", "coordinate"), stored(item), quantity_of(item, name).attributes())
                coordinates["coordinate"] = ("coordinate", list(self.coordinates), {})
        for name in self.observables:
            variables[name] = ("time", stored(self._observable(name)), self.observable_quantity(name).attributes())
        events = self.events
        if events is not None:
            variables["event_time"] = ("event", events.time, {"units": "s"})
            variables["event_contact"] = ("event", events.contact)
            variables["event_state"] = ("event", events.state)
        for name in self.extrema_observables:
            extrema, rows = self.extrema(name), f"{name}_extremum"
            variables[rows] = (rows, extrema.value, self.extrema_quantity(name).attributes())
            variables[f"{rows}_time"] = (rows, extrema.time, {"units": "s"})
            variables[f"{rows}_kind"] = (rows, extrema.kind)
        for name in self._members("strobe", h5py.Group):
            rows, value = f"{name}_strobe", self._dataset(f"strobe/{name}/value")
            variables[rows] = (rows, stored(value), quantity_of(value, name).attributes())
            variables[f"{rows}_time"] = (rows, stored(self._dataset(f"strobe/{name}/time")), {"units": "s"})
        variables |= self._as_stored("lyapunov", "rotation")
        single = [f"{of}/{name}" for of in ("contact", "average") for name in self._members(of, h5py.Group)]
        for group in ("outcome", *single):
            for name in self._members(group, h5py.Dataset):
                item = self._dataset(f"{group}/{name}")
                if item.size == 1:
                    own = f"{group.split('/', 1)[-1]}.{name}"
                    variables[own] = ((), item[()].item(), quantity_of(item, name).attributes())
        return xarray.Dataset(variables, coordinates, attrs=self.attributes())

    def _state(self, name: str) -> h5py.Dataset:
        item = self._dataset(f"state/{name}")
        times = self._vector("time").shape[0]
        if item.ndim != 2 or item.shape[0] != times:
            raise ResultError(
                f"{self.path}: dataset 'state/{name}' has shape {item.shape}, expected ({times}, coordinates)"
            )
        return item

    def _observable(self, name: str) -> h5py.Dataset:
        choose(name, self.observables, "observable", self.path)
        return self._vector(f"observable/{name}", self._vector("time").shape[0])

    def _index(self, coordinate: str) -> int:
        return self.coordinates.index(choose(coordinate, self.coordinates, "coordinate", self.path))

    def _column(self, name: str, coordinate: str, part: slice) -> NDArray[np.float64]:
        item = self._state(name)
        column = self._index(coordinate)
        if column >= item.shape[1]:
            raise ResultError(f"{self.path}: dataset 'state/{name}' has no column for coordinate '{coordinate}'")
        return np.asarray(item[part, column], dtype=np.float64)

    def _extrema_data(self, observable: str) -> ExtremaData:
        choose(observable, self.extrema_observables, "extrema of observable", self.path)
        group = f"extrema/{observable}"
        return ExtremaData(self._dataset(f"{group}/value"), self._find(f"{group}/time"), self._find(f"{group}/kind"))

    def _event_data(self, name: str, count: int, missing: int) -> NDArray[np.int64]:
        if self._find(f"event/{name}") is None:
            return np.full(count, missing, dtype=np.int64)
        return np.asarray(self._vector(f"event/{name}", count)[()], dtype=np.int64)
