"""Result files made by hand, in the layout that razy writes."""

from pathlib import Path

import h5py
import numpy as np

ROOT = {
    "razy_version": "0.1.0",
    "git_commit": "0123456789abcdef0123456789abcdef01234567",
    "integrator": "exact",
    "input": "&scene kind='lumped' /\n",
}

SPEEDS, TORQUES = np.array([1000.0, 1100.0, 1300.0]), np.array([50.0, 60.0])

# As the programs write it.
BRANCHES = [
    "1 = open, 2 = closed (upper side), 3 = closed (lower side), 6 = open, 1 pair in mesh, "
    "7 = closed (upper side), 1 pair in mesh, 8 = closed (lower side), 1 pair in mesh, 11 = open, 2 pairs in mesh, "
    "12 = closed (upper side), 2 pairs in mesh, 13 = closed (lower side), 2 pairs in mesh"
]


def dataset(group: h5py.Group, name: str, data, units: str = "1", long_name: str | None = None, **attributes):
    item = group.create_dataset(name, data=data)
    item.attrs.update({"units": units, "long_name": long_name or name, **attributes})
    return item


def dimension_only(group: h5py.Group, name: str, length: int):
    item = group.create_dataset(name, shape=(length,), dtype="f4")
    item.make_scale(f"This is a netCDF dimension but not a netCDF variable. {length:9d}")


def root(path: Path, program: str, title: str = "") -> h5py.File:
    file = h5py.File(path, "w")
    file.attrs.update({**ROOT, "program": program, "title": title})
    return file


def write_sweep(
    path: Path,
    parameter: np.ndarray,
    extrema: dict[str, tuple[list[np.ndarray], list[np.ndarray]]],
    status: np.ndarray | None = None,
    title: str = "Torsional gear pair",
    units: str = "m",
) -> Path:
    """Write a sweep; `extrema` has for each observable the values and the kinds of each point."""
    name = "rotation.speed_rpm"
    with root(path, "razy-sweep", title) as file:
        dataset(file, f"axis/{name}", parameter, "rpm", name)
        dataset(file, f"point/{name}", parameter, "rpm", name)
        dimension_only(file, "point/point", parameter.size)
        status = np.zeros(parameter.size, dtype=np.int32) if status is None else status
        dataset(file, "point/status", status.astype(np.int32), meanings="0 = ok, 1 = too many events, 2 = overflow")
        dataset(file, "point/events", np.arange(parameter.size, dtype=np.int64))
        for observable, (values, kinds) in extrema.items():
            group = file.create_group(f"extrema/{observable}")
            counts = [len(point) for point in values]
            dataset(group, "offset", np.concatenate(([0], np.cumsum(counts))).astype(np.int64))
            dataset(group, "value", np.concatenate(values), units, observable.replace("_", " "))
            dataset(group, "time", np.concatenate([0.25 + 1e-4 * np.arange(count) for count in counts]), "s")
            dataset(group, "kind", np.concatenate(kinds).astype(np.int8))
            dimension_only(group, "boundary", parameter.size + 1)
            dimension_only(group, "extremum", sum(counts))
            for column, scale in (
                ("offset", "boundary"),
                *((column, "extremum") for column in ("value", "time", "kind")),
            ):
                group[column].dims[0].attach_scale(group[scale])
        for column in (name, "status", "events"):
            file[f"point/{column}"].dims[0].attach_scale(file["point/point"])
        file[f"axis/{name}"].make_scale(name)
    return path


def ragged(points: int, seed: int = 1) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Return values and kinds of 0 to 6 extrema at each point, the first point with none."""
    random = np.random.default_rng(seed)
    counts = random.integers(0, 7, points)
    counts[0] = 0
    kinds = [np.where(np.arange(count) % 2 == 0, 1, -1) for count in counts]
    return [1e-5 * (kind + 0.1 * random.standard_normal(kind.size)) for kind in kinds], kinds


def logistic(points: int, each: int) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Return the logistic map as extrema: x as maxima, its mirror image as minima; `each` values a point, half each."""
    rate = np.linspace(2.9, 4.0, points)
    x = np.full(points, 0.5)
    for _ in range(500):
        x = rate * x * (1.0 - x)
    rows = np.empty((points, each))
    for column in range(0, each, 2):
        x = rate * x * (1.0 - x)
        rows[:, column], rows[:, column + 1] = 1e-4 * x, -1e-4 * x
    kind = np.where(np.arange(each) % 2 == 0, 1, -1)
    return list(rows), [kind] * points


def write_run(path: Path, times: int = 2000, trajectory: bool = True, observable: bool = True) -> Path:
    """Write a motion x = 1e-3 sin(100 t), y = 2e-3 cos(100 t) with events where x = 0."""
    time = np.linspace(0.0, 0.25, times)
    displacement = np.stack((1e-3 * np.sin(100 * time), 2e-3 * np.cos(100 * time)), axis=1)
    velocity = np.stack((0.1 * np.cos(100 * time), -0.2 * np.sin(100 * time)), axis=1)
    event = np.pi / 100 * np.arange(1, 8)
    with root(path, "razy-run", "Two masses") as file:
        if trajectory:
            dimension_only(file, "sample", times)
            dataset(file, "time", time, "s", "time")
            dataset(file, "state/time", time, "s", "time").make_scale("time")
            dataset(file, "state/coordinate", ["x", "y"]).make_scale("coordinate")
            names = {"names": ["x", "y"], "coordinate_units": ["m", "m"]}
            dataset(file, "state/displacement", displacement, "m", "displacement", **names)
            dataset(file, "state/velocity", velocity, "m/s", "velocity", **names)
            if observable:
                dataset(file, "observable/time", time, "s", "time").make_scale("time")
                dataset(file, "observable/mesh_deformation", displacement[:, 0], "m", "mesh deformation")
        dataset(file, "event/time", event, "s", "time")
        dataset(file, "event/contact", np.ones(event.size, dtype=np.int32), names=["mesh"])
        dataset(file, "event/state", np.arange(event.size, dtype=np.int32) % 2 + 1, meanings=BRANCHES)
        group = file.create_group("extrema/mesh_deformation")
        dimension_only(group, "extremum", 8)
        kind = np.where(np.arange(8) % 2 == 0, 1, -1)
        dataset(group, "value", 1e-3 * kind, "m", "mesh deformation")
        dataset(group, "time", np.pi / 100 * (np.arange(8) + 0.5), "s")
        dataset(group, "kind", kind.astype(np.int8))
    return path


def write_tune(path: Path, points: int = 101, gap: float = 0.5) -> Path:
    """Write a tuning of a spring k beside a mode of 2 Hz: the mode is the first up to k = 4, then the second."""
    parameter = np.linspace(1.0, 9.0, points)
    first, second = (np.sqrt((parameter + 4.0) / 2 + sign * np.hypot((parameter - 4.0) / 2, gap)) for sign in (-1, 1))
    place = np.where(parameter <= 4.0, 1, 2)
    found = np.where(place == 1, first, second)
    with root(path, "razy-tune", "Two masses") as file:
        mode = "the mode that is mostly a"
        dataset(file, "parameter", parameter, "N/m", "spring(1)%stiffness")
        dataset(file, "objective", (1 - found / 2.7) ** 2, "1", f"(1 - f/goal)^2 of {mode}")
        dataset(file, "tuned_frequency", found, "Hz", f"natural frequency of {mode}")
        dataset(file, "tuned_place", place.astype(np.int32), "1", f"place of {mode}")
        dataset(file, "mode", np.array([1, 2], dtype=np.int32))
        dataset(file, "frequency", np.stack((first, second), axis=1), "Hz", "natural frequency")
        dimension_only(file, "order", 2)
        dataset(file, "frequency_before", np.array([1.0, 2.0]), "Hz")
        dataset(file, "frequency_after", np.array([2.0, 2.7]), "Hz")
        for name, value, units in (("goal", 2.7, "Hz"), ("reference", 1.0, "N/m"), ("share", 0.9, "1")):
            dataset(file, name, value, units)
        dataset(file, "optimum", 7.21, "N/m", "spring(1)%stiffness, tuned", mode=mode)
    return path


def write_follow(path: Path, name: str = "load.frequency") -> Path:
    """Write two branches over p = 10 + 3 a - a³: period 1 with extrema ±(5 + a), folds at a = ±1 and a doubling at 1.4.

    From the doubling a branch of period 2 goes on with maxima 6.4 ± b, minima -6.4 ± b, p = 11.456 + b², up to b = 0.5.
    """
    a, b = np.linspace(-1.6, 1.6, 161), np.linspace(0.0, 0.5, 26)[1:]
    p = np.concatenate((10.0 + 3.0 * a - a**3, 11.456 + b**2))
    labels = np.full(p.size, "", dtype="<U2")
    for label, place in (("GR", 15), ("LP", 30), ("LP", 130), ("PD", 150), ("EP", 160), ("EP", 185)):
        labels[place] = label
    multiplicity = np.repeat((1, 2), (161, 25))
    largest = np.concatenate((np.exp(0.5 - 0.5 * np.abs(a)), np.full(25, 0.5)))
    largest[:161] = np.where(a > 1.41, 1.2, np.where(a > 1.39, 1.0, largest[:161]))
    multiplier = np.zeros((p.size, 2, 2))
    multiplier[:, 0, 0] = largest
    maxima = [np.array([5.0 + x]) for x in a] + [np.array([6.4 + x, 6.4 - x]) for x in b]
    minima = [np.array([-5.0 - x]) for x in a] + [np.array([-6.4 + x, -6.4 - x]) for x in b]
    with root(path, "razy-follow", "Fold") as file:
        dimension_only(file, "point/point", p.size)
        dataset(file, "point/branch", np.repeat((1, 2), (161, 25)).astype(np.int32))
        dataset(file, f"point/{name}", p, "Hz", name.replace(".", "%"))
        dataset(file, "point/period", multiplicity / p, "s")
        dataset(file, "point/multiplicity", multiplicity.astype(np.int32))
        dataset(file, "point/stable", (largest < 1.0).astype(np.int32))
        dataset(file, "point/multiplier", multiplier)
        dataset(file, "point/state", np.zeros((p.size, 2)), "mixed")
        group = file.create_group("extrema/displacement")
        dataset(group, "offset", np.concatenate(([0], np.cumsum(2 * multiplicity))).astype(np.int64))
        pairs = [np.stack(pair, axis=1).ravel() for pair in zip(maxima, minima, strict=True)]
        dataset(group, "value", 1e-3 * np.concatenate(pairs), "m", "extrema of displacement of block")
        phases = [(np.arange(2 * n) / 2 + 0.25) / x for n, x in zip(multiplicity, p, strict=True)]
        dataset(group, "time", np.concatenate(phases), "s")
        dataset(group, "kind", np.tile((1, -1), multiplicity.sum()).astype(np.int8))
        at = np.flatnonzero(labels != "")
        dataset(file, "special/label", [str(item) for item in labels[at]])
        dataset(file, "special/parameter", p[at], "Hz", name.replace(".", "%"))
        dataset(file, "special/branch", np.where(at < 161, 1, 2).astype(np.int32))
        dataset(file, "special/point", at.astype(np.int32))
        dataset(file, "special/contact", ["stop" if item == "GR" else "" for item in labels[at]])
        dataset(file, "branch/parent", np.array([0, 1], dtype=np.int32))
        dataset(file, "branch/ending", ["the end of the range", "the most points"])
    return path


def write_modes(path: Path, limit: float = 80.0) -> Path:
    """Write a forward and a backward branch, and a branch without whirl that crosses the forward one at 50 rad/s."""
    speed = np.linspace(0.0, 100.0, 11)
    curves = np.stack((10.0 - 0.02 * speed, 10.0 + 0.02 * speed, np.full(11, 11.0)), axis=1)
    order = np.argsort(curves, axis=1, kind="stable")
    with root(path, "razy-modes", "Rotor") as file:
        dataset(file, "speed", speed, "rad/s")
        dataset(file, "frequency", np.take_along_axis(curves, order, axis=1), "Hz")
        dataset(file, "branch", order + 1.0)
        dataset(file, "direction", np.array([-1.0, 1.0, 0.0])[order])
        dimension_only(file, "critical", 1)
        dataset(file, "critical_speed", np.array([60.0]), "rad/s")
        dataset(file, "critical_order", np.array([1.0]))
        dataset(file, "critical_frequency", np.array([60.0 / (2 * np.pi)]), "Hz")
        dataset(file, "stability_limit", limit, "rad/s")
    return path


def write_duel(path: Path) -> Path:
    """Write a duel of a method with two settings and of exact."""
    with root(path, "razy-duel", "Two methods") as file:
        dataset(file, "series", np.array([1, 1, 2], dtype=np.int32))
        text = h5py.string_dtype()
        dataset(file, "method", np.array(["dop853", "dop853", "exact"], dtype=object).astype(text))
        dataset(file, "treatment", np.array(["event", "event", "event"], dtype=object).astype(text))
        dataset(file, "sharpness", np.zeros(3))
        dataset(file, "setting_is_step", np.zeros(3, dtype=np.int32))
        dataset(file, "setting", np.array([1e-6, 1e-9, 1e-9]))
        dataset(file, "error", np.array([1e-5, np.nan, 0.0]))
        dataset(file, "event_time_error", np.array([1e-7, np.nan, 0.0]), "s")
        dataset(file, "cpu_time", np.array([1e-3, 2e-3, 1e-4]), "s")
        dataset(file, "rhs_evaluations", np.array([1000, 2000, 0]))
        dataset(file, "event_surplus", np.array([1, 0, 0]))
        dataset(file, "status", np.array([0, 6, 0], dtype=np.int32))
        dataset(file, "reference/error", np.array([1e-12]), reference="exact", check="dop853")
    return path


def write_scene(path: Path, with_elements: bool = True) -> Path:
    """Add to a file a block on the ground: a spring below it, a stop above, an exciter on it."""
    with h5py.File(path, "r+") as file:
        group = file.create_group("scene")
        dataset(group, "axis", ["x", "y"])
        dataset(group, "body", ["block", "cover"])
        dataset(group, "centre", np.array([[0.0, 0.5], [0.0, 1.5]]), "m")
        dataset(group, "size", np.array([[1.0, 0.6], [1.0, 0.4]]), "m")
        dataset(group, "point", ["foot", "top", "under"])
        dataset(group, "point_body", np.array([1, 1, 2], dtype=np.int32))
        dataset(group, "position", np.array([[0.3, 0.2], [0.0, 0.8], [0.0, 1.3]]), "m")
        if not with_elements:
            return path
        dataset(group, "element", ["support", "lid", "shaker", "load 1"])
        kinds = "1 = spring, 2 = damper, 3 = stop, 4 = exciter, 5 = load"
        dataset(group, "kind", np.array([1, 3, 4, 5], dtype=np.int32), meanings=kinds)
        dataset(group, "first_body", np.array([1, 2, 1, 1], dtype=np.int32))
        dataset(group, "second_body", np.array([0, 1, 1, 0], dtype=np.int32))
        dataset(group, "first", np.array([[0.3, 0.2], [0.0, 1.3], [-0.2, 0.5], [0.0, 0.8]]), "m")
        dataset(group, "second", np.array([[0.3, 0.2], [0.0, 0.8], [0.2, 0.5], [0.0, 0.8]]), "m")
        dataset(group, "direction", np.array([[0.0, 1.0], [0.0, 1.0], [0.0, 1.0], [0.0, 0.0]]))
    return path


def write_grid(path: Path) -> Path:
    """Write a sweep over two axes, the second fastest; the force of `mesh` is 10 speed + torque, that of `stop` 1."""
    with root(path, "razy-sweep", "grid") as file:
        names = ("rotation.speed_rpm", "load(1).value")
        for name, axis, values in zip(
            names, (SPEEDS, TORQUES), (np.repeat(SPEEDS, 2), np.tile(TORQUES, 3)), strict=True
        ):
            dataset(file, f"axis/{name}", axis, "rpm", name)
            dataset(file, f"point/{name}", values, "rpm", name)
        dimension_only(file, "point/point", 6)
        dataset(file, "point/status", np.array([0, 0, 0, 0, 0, 2], dtype=np.int32), coordinates=" ".join(names))
        dataset(file, "point/period", np.array([1, 2, 3, 5, 0, -1], dtype=np.int32))
        dataset(file, "point/touched", np.array([1, 2, 3, 0, 1, 0], dtype=np.int64), names=["mesh", "stop"])
        dimension_only(file, "contact/point", 6)
        force = 10 * np.repeat(SPEEDS, 2) + np.tile(TORQUES, 3)
        dataset(file, "contact/mesh/largest_force", force, "N", "mesh: largest force")
        dataset(file, "contact/stop/largest_force", np.ones(6), "N", "stop: largest force")
    return path


def write_basins(path):
    """Two speeds, starts on a grid of 3 x 2; the displacement decides, and one start fails."""
    start = np.repeat(np.arange(1, 7), 2)
    with h5py.File(write_sweep(path, np.array([1.0, 2.0]), {}), "r+") as file:
        for name in list(file["point"]):
            del file["point"][name]
        dimension_only(file, "point/point", 12)
        dataset(file, "point/rotation.speed_rpm", np.tile([1.0, 2.0], 6), "rpm")
        dataset(file, "point/status", np.zeros(12, dtype=np.int32))
        dataset(file, "point/start", start.astype(np.int32))
        dataset(file, "point/start.block.displacement", np.repeat([-1.0, 0.0, 1.0], 4), "m")
        dataset(file, "point/start.block.velocity", np.tile(np.repeat([-2.0, 2.0], 2), 3), "m/s")
        dataset(file, "point/attractor", np.array([1, 1, 1, 1, 1, 2, 2, 2, 2, 2, -1, 0], dtype=np.int32))
        dataset(file, "attractor/offset", np.array([0, 2, 5]))
        dataset(file, "attractor/number", np.array([1, 2, 1, 2, 0], dtype=np.int32))
        dataset(file, "attractor/period", np.array([1, 3, 1, 2, 0], dtype=np.int32))
    return path


def add_curves(path: Path) -> Path:
    """Add to branches curves over two parameters: a fold p = 10 + q and a doubling of period 2, p = 12."""
    q = np.linspace(1.0, 3.0, 5)
    with h5py.File(path, "r+") as file:
        dataset(file, "curve/label", ["LP", "PD"])
        dataset(file, "curve/contact", ["", ""])
        dataset(file, "curve/branch", np.array([1, 1], dtype=np.int32))
        dataset(file, "curve/multiplicity", np.array([1, 2], dtype=np.int32))
        dataset(file, "curve_point/curve", np.repeat((1, 2), 5).astype(np.int32))
        dataset(file, "curve_point/load.frequency", np.concatenate((10 + q, 12 + 0 * q)), "Hz", "load%frequency")
        dataset(file, "curve_point/damping.value", np.tile(q, 2), "N s/m", "damping%value")
        dataset(file, "junction/label", ["LP+PD"])
        dataset(file, "junction/load.frequency", np.array([12.0]), "Hz", "load%frequency")
        dataset(file, "junction/damping.value", np.array([2.0]), "N s/m", "damping%value")
    return path


def add_sensitivities(path: Path) -> Path:
    """Add to branches that the first two special points move by 2 and -3, and by 0.5 and not known, for each unit."""
    with h5py.File(path, "r+") as file:
        dataset(file, "sensitivity/name", ["damper.damping", "stop.clearance"])
        dataset(file, "sensitivity/value", np.array([4.0, 0.1]), "mixed")
        dataset(file, "sensitivity/special", np.array([0, 1], dtype=np.int32))
        for name, slope in (("damper.damping", [2.0, -3.0]), ("stop.clearance", [0.5, np.nan])):
            dataset(file, f"sensitivity/{name}", np.array(slope), "Hz/m")
            dataset(file, f"sensitivity/{name}_error", np.array([1e-8, 1e-9]), "Hz/m")
    return path


LAWS = """&scene kind='lumped' /
&mass name='m', value=1.0 /
&inertia name='r', value=1.0 /
&spring between='m','frame', law='linear', stiffness=1.0 /
&spring name='table', between='m','frame', law='table', displacement=-1.0,0.0,2.0, force=-2.0,0.0,1.0,
        beyond='continue' /
&spring name='cubic', between='m','frame', law='polynomial', coefficients=-1.0,0.0,0.5 /
&spring name='slider', between='r','frame', law='jenkins', stiffness=2.0, slip_force=0.5 /
&stop name='wall', between='m','frame', side='both', clearance=0.6, law='rigid', restitution=0.7 /
&stop name='ball', between='m','frame', side='lower', clearance=1e-3, law='hertz', radius=0.01,0.03, young_modulus=2e11,
      poisson_ratio=0.3 /
&stop name='preload', between='m','frame', side='upper', clearance=-0.1, law='kelvin_voigt', stiffness=20.0 /
&gear_mesh name='mesh', between='r','r', stiffness=4e8, backlash=1e-4, back_stiffness=3e8, slope_in_backlash=0.1 /
&friction name='rub', between='m','frame', static_coefficient=0.4, kinetic_coefficient=0.2, decay=3.0,
          decay_law='exponential', viscous_coefficient=0.1, normal_load=10.0 /
"""


def with_input(path: Path, text: str) -> Path:
    with h5py.File(path, "r+") as file:
        file.attrs["input"] = text
    return path
