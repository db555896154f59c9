"""A point of a sweep that starts as razy-run does has its bits."""

import re
import shlex

import f90nml
import h5py
import numpy as np
import pytest
from programs import GEAR_PAIR, SOURCE, sets, succeed

# Long enough for every kind of event of the input.
LONGEST = 1.0
GROUPS = r"(?ms)^[ ]*&(?:sweep|starts|start_range|follow|response|duel|record)\b.*?/[ ]*$"
INPUTS = [path for path in sorted((SOURCE / "inputs").glob("*.nml")) if "&motion" in path.read_text()]


def listed(groups):
    return groups if isinstance(groups, list) else [groups]


def records_for_a_sweep(groups, start):
    """Extrema of what the input records, and statistics of its contacts."""
    names = {(group["observable"], group.get("of", "")) for group in listed(groups.get("record", []))}
    lines = []
    for name, of in sorted(names):
        if name != "state" and of != "all":
            place = f"of='{of}', " if of else ""
            lines.append(f"&record observable='{name}', {place}what='extrema', from={start!r} /")
    if set(groups) & {"stop", "gear_mesh", "planar_stop", "friction", "rotor_stop"} or not lines:
        lines.append(f"&record observable='contact_force', of='all', what='statistics', from={start!r} /")
    return "\n".join(lines)


def axis_of(groups, t_end):
    """The input's own axis where that is a number of the machine, else the duration."""
    own = listed(groups.get("sweep", {}))[0]
    names = own.get("parameter")
    if names is None:
        return ["motion%t_end"], 0.5 * t_end, t_end
    last = own.get("last", own["first"])
    return listed(names)[:1], own["first"], last


def results(file, point=None):
    """Extrema and statistics of a run, or of a point of a sweep, and its number of events."""
    found = {}

    def keep(name, item):
        if not isinstance(item, h5py.Dataset) or name.split("/")[0] not in ("extrema", "contact"):
            return
        if name.endswith("/point") or (
            name.startswith("extrema") and name.split("/")[-1] not in ("value", "time", "kind")
        ):
            return
        if point is None:
            found[name] = np.atleast_1d(item[()])
        elif name.startswith("contact"):
            found[name] = item[point : point + 1]
        else:
            first, beyond = file[name.rsplit("/", 1)[0] + "/offset"][point : point + 2]
            found[name] = item[first:beyond]

    file.visititems(keep)
    return found


def assert_same(run, sweep, point):
    with h5py.File(run) as one, h5py.File(sweep) as all_of_them:
        alone, there = results(one), results(all_of_them, point)
        assert there
        for name, values in there.items():
            assert np.array_equal(alone[name], values, equal_nan=True), name
        if "event/time" in one:
            assert one["event/time"].size == all_of_them["point/events"][point]


@pytest.mark.parametrize("path", INPUTS, ids=lambda path: path.stem)
def test_a_point_has_the_bits_of_a_run(path, folder):
    groups = f90nml.read(path)
    t_end = min(groups["motion"]["t_end"], LONGEST)
    text = re.sub(GROUPS, "", path.read_text())
    text = (
        re.sub(r"\bt_end=[-+.\de]+", f"t_end={t_end!r}", text) + "\n" + records_for_a_sweep(groups, 0.3 * t_end) + "\n"
    )
    (parameter,), first, last = axis_of(groups, t_end)
    (folder / "run.nml").write_text(text)
    sweep = f"&sweep parameter='{parameter}', first={first!r}, last={last!r}, points=2 /\n"
    (folder / "sweep.nml").write_text(text + sweep)
    succeed("razy-sweep", "sweep.nml", "--output", "sweep.h5")
    succeed("razy-run", "run.nml", "--set", f"{parameter}={last!r}", "--output", "run.h5")
    assert_same("run.h5", "sweep.h5", 1)


def test_a_chaotic_point_has_the_bits_of_a_run():
    succeed("razy-run", GEAR_PAIR, *sets(rotation__speed_rpm=2000), "--output", "run.h5")
    succeed("razy-sweep", GEAR_PAIR, *sets(sweep__first=1996, sweep__last=2004), "--output", "sweep.h5")
    assert_same("run.h5", "sweep.h5", 1)
    with h5py.File("run.h5") as run:
        assert run["event/time"].size > 1000


def test_the_commands_of_the_log_have_the_bits_of_points_with_starts(folder):
    few = ["--set", "start_range(1)%points=3", "--set", "start_range(2)%points=3", "--set", "motion%t_end=8.0"]
    case = SOURCE / "inputs" / "basins.nml"
    succeed("razy-sweep", case, *few, "--output", "sweep.h5", "--log", "sweep.log")
    commands = re.findall(r"slow point (\d+): .*? ms: (.*)", (folder / "sweep.log").read_text())
    assert len(commands) > 2
    for point, command in commands:
        program, *words = shlex.split(command)
        assert "start_range(1)%values" in command and words[-2:] == ["--output", f"point_{point}.h5"]
        succeed(program, *words)
        assert_same(f"point_{point}.h5", "sweep.h5", int(point))


def test_a_rigid_stop_that_is_never_touched_changes_nothing(folder):
    # Through an event of the teeth both machines go by the same path; only the start is settled in one of them.
    groups = r"(?m)^&(?:scene|inertia|spring|gear_mesh|load|rotation)\b.*$"
    machine = "\n".join(re.findall(groups, GEAR_PAIR.read_text()))
    values = []
    for law in ("stiffness=1e5", "law='rigid', restitution=0.8"):
        path = folder / "far.nml"
        path.write_text(
            f"{machine}\n&stop name='far', between='motor','pinion', side='upper', clearance=100.0, {law} /\n"
            "&motion t_end=0.2, start='zero', integrator='exact' /\n"
            "&record observable='mesh_deformation', what='extrema' /\n"
        )
        succeed("razy-run", path, "--set", "rotation%speed_rpm=3000", "--force")
        with h5py.File(path.with_suffix(".h5")) as file:
            values.append(file["extrema/mesh_deformation/value"][:])
    assert values[0].size > 100
    assert np.allclose(*values, rtol=0, atol=1e-11 * np.abs(values[0]).max())


@pytest.mark.parametrize(
    "record",
    ["observable='state', what='trajectory', interval=0.01", "observable='displacement', of='motor', what='extrema'"],
)
def test_what_is_recorded_changes_no_bit(record, folder):
    # A chaotic motion, of which contacts feel two of four coordinates.
    text = re.sub(r"(?ms)^&(?:record|sweep|follow|motion)\b.*?/[ ]*$", "", GEAR_PAIR.read_text())
    text += "\n&motion t_end=0.5, start='static', integrator='exact' /\n"
    text += "&record observable='mesh_deformation', what='extrema' /\n"
    values = []
    for more in ("", f"&record {record} /\n"):
        path = folder / "recorded.nml"
        path.write_text(text + more)
        succeed("razy-run", path, "--set", "rotation%speed_rpm=2000", "--force")
        with h5py.File(path.with_suffix(".h5")) as file:
            values.append(file["extrema/mesh_deformation/value"][:])
    assert np.array_equal(*values)


def test_what_no_contact_feels_has_its_closed_form(folder):
    # Beside a body that bounces stands one that swings under a load, free of it; both are observed.
    path = folder / "beside.nml"
    path.write_text(
        "&scene kind='lumped' /\n&mass name='a', value=1.0 /\n&mass name='b', value=2.0 /\n"
        "&spring between='a','frame', stiffness=100.0, damping=0.2 /\n"
        "&spring between='b','frame', stiffness=200.0, damping=0.8 /\n"
        "&stop name='s', between='a','frame', side='upper', clearance=0.01, stiffness=1e4 /\n"
        "&load on='a', amplitude=3.0, angular_frequency=9.0 /\n"
        "&load on='b', amplitude=6.0, angular_frequency=7.0, phase=90.0 /\n"
        "&initial on='b', displacement=0.1, velocity=-0.5 /\n&motion t_end=400.0, start='given', integrator='exact' /\n"
        "&record observable='state', what='trajectory', interval=0.5 /\n"
        "&record observable='displacement', of='b', what='extrema', from=390.0 /\n"
    )
    succeed("razy-run", path)
    with h5py.File(path.with_suffix(".h5")) as file:
        time = file["state/time"][:]
        b = list(file["state/displacement"].attrs.get("names", ["a", "b"])).index("b")
        displacement, velocity = file["state/displacement"][:, b], file["state/velocity"][:, b]
        extrema, times = file["extrema/displacement.b/value"][:], file["extrema/displacement.b/time"][:]
    free, driven = np.roots([1.0, 0.4, 100.0])[0], 3.0 / (100.0 - 49.0 + 0.4j * 7.0)
    # x = Re(driven e^(7it) + rest e^(free t)) with x(0) = 0.1 and x'(0) = -0.5.
    first = 0.1 - driven.real
    rest = first + 1j * (free.real * first - (-0.5 - (7j * driven).real)) / free.imag
    x = (driven * np.exp(7j * time) + rest * np.exp(free * time)).real
    v = (7j * driven * np.exp(7j * time) + free * rest * np.exp(free * time)).real
    assert np.allclose(displacement, x, rtol=0, atol=1e-13)
    assert np.allclose(velocity, v, rtol=0, atol=1e-12)
    assert extrema.size > 20
    assert np.allclose(np.abs(extrema), np.abs(driven), rtol=1e-12)
    assert np.allclose((driven * np.exp(7j * times)).real, extrema, rtol=0, atol=1e-13)
