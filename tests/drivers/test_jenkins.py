"""Springs and sliders in series, `law='jenkins'`, and sums of them: closed forms, and an integrator beside."""

import numpy as np
import pytest
from programs import SOURCE, run, start
from scipy.integrate import solve_ivp

INPUTS = SOURCE / "inputs"
RECORD = "&record observable='displacement', of='m', what='extrema' /\n"
TIGHT = ("--set", "motion%relative_tolerance=1e-12", "--set", "motion%absolute_tolerance=1e-14")


def case(tmp_path, *groups, motion):
    path = tmp_path / "case.nml"
    path.write_text("\n".join((*groups, f"&motion {motion} /")) + "\n")
    return path


def slide(period, springs, sliders, mass, damping, rows, force, t_end, at):
    """Displacements (times, bodies) of masses on springs, functions of their stretch, and sliders (k, F), from rest.

    `rows` has the direction of each spring and then of each slider.
    """
    n, m = len(mass), len(sliders)
    stretched, slid = np.array(rows[:-m]), np.array(rows[-m:])
    k, limit = np.array(sliders).T
    origin, way = np.zeros(m), np.zeros(m)
    time, z, found = 0.0, np.zeros(2 * n), []

    def rate(t, z):
        x, v = z[:n], z[n:]
        held = np.where(way == 0, k * (slid @ x - origin), way * limit)
        pull = [spring(s) for spring, s in zip(springs, stretched @ x, strict=True)] + damping * (stretched @ v)
        return np.concatenate((v, (force(t) - stretched.T @ pull - slid.T @ held) / mass))

    def beyond(j):
        if way[j] == 0:
            return lambda t, y: limit[j] / k[j] - abs(slid[j] @ y[:n] - origin[j])
        return lambda t, y: way[j] * (slid[j] @ y[n:])

    while time < t_end:
        leaves = [beyond(j) for j in range(m)]
        for leave in leaves:
            leave.terminal, leave.direction = True, -1
        done = solve_ivp(
            rate, (time, t_end), z, method="DOP853", rtol=1e-13, atol=1e-15, events=leaves, dense_output=True,
            max_step=period / 40,
        )  # fmt: skip
        now = at[(at >= time) & (at < done.t[-1])]
        if now.size:
            found.append(done.sol(now)[:n].T)
        time, z = done.t[-1], done.y[:, -1]
        for j in np.flatnonzero([events.size for events in done.t_events]):
            if way[j] == 0:
                way[j] = np.sign(slid[j] @ z[:n] - origin[j])
            else:
                origin[j] = slid[j] @ z[:n] - way[j] * limit[j] / k[j]
                way[j] = 0
    return np.concatenate(found)


@pytest.mark.parametrize(("method", "error"), [("exact", 1e-15), ("dop853", 1e-12), ("radau5", 1e-11)])
def test_a_step_of_force_leaves_a_plastic_set(folder, tmp_path, method, error):
    mass, k, limit, load = 2.0, 50.0, 0.5, 0.4
    path = case(
        tmp_path, f"&mass name='m', value={mass} /", f"&load on='m', value={load} /",
        f"&spring name='slider', between='m','frame', law='jenkins', stiffness={k}, slip_force={limit} /",
        "&record what='trajectory', observable='displacement', interval=0.05 /",
        "&record what='trajectory', observable='contact_force', interval=0.05 /",
        motion=f"t_end=60.0, integrator='{method}', start='zero'",
    )  # fmt: skip
    found = run(path, *(TIGHT if method != "exact" else ()))
    w, edge, falls = np.sqrt(k / mass), limit / k, (limit - load) / mass
    slides = np.arccos(1 - edge * k / load) / w
    speed = load / k * w * np.sin(w * slides)
    stops = slides + speed / falls
    farthest = edge + speed**2 / (2 * falls)
    # From there it swings about load/k from where the slider stands, and comes to the limit again but never beyond it.
    time = found["observable/time"]
    x = np.where(time < slides, load / k * (1 - np.cos(w * time)), 0.0)
    middle = (time >= slides) & (time < stops)
    x[middle] = (edge + speed * (time - slides) - 0.5 * falls * (time - slides) ** 2)[middle]
    after = farthest - (limit - load) / k * (1 - np.cos(w * (time - stops)))
    x[time >= stops] = after[time >= stops]
    np.testing.assert_allclose(found["observable/displacement"], x, rtol=0, atol=error)
    force = np.where(time < slides, k * x, np.where(time < stops, limit, limit - k * (farthest - x)))
    np.testing.assert_allclose(found["observable/contact_force"], force, rtol=0, atol=100 * error)
    assert found["event/time"] == pytest.approx([slides, stops], rel=1e-11)


def test_what_sliders_take_out_of_a_period(folder):
    found = run(INPUTS / "iwan.nml")
    amplitude = np.abs(found["extrema/displacement.flange/value"])
    assert np.ptp(amplitude) < 1e-14
    for name, limit in (("first", 2.0), ("second", 4.0), ("third", 7.0), ("fourth", 12.0)):
        loss = 4 * limit * max(0.0, amplitude[0] - limit / 5.0e3)
        assert found[f"contact/{name}/dissipated_energy_per_period"] == pytest.approx(loss, rel=1e-10, abs=1e-15), name
    assert amplitude[0] > 7.0 / 5.0e3


def test_a_chain_with_sliders_and_cubic_springs(folder):
    """Example 7 of NLvib; the response of the first 60 s by an integrator of its own."""
    found = run(
        INPUTS / "field" / "jenkins_chain.nml", *TIGHT, "--set", "motion%t_end=60", "--set", "record(1)%from=0",
        "--set", "record(2)%from=0", "--set", "record(3)%from=0", "--set", "record(1)%what='trajectory'", "--set",
        "record(1)%interval=0.25", "--set", "record(2)%what='trajectory'", "--set", "record(2)%interval=0.25", "--set",
        "record(3)%what='trajectory'", "--set", "record(3)%interval=0.25",
    )  # fmt: skip

    def linear(s):
        return s

    def cubic(s):
        return s**3

    def stop(s):
        return max(0.0, s - 0.25)

    first, second, third = np.eye(3)
    rows = [first, second - first, third - second, third, second, third - second, third, first, second - first]
    x = slide(
        2 * np.pi, [linear] * 4 + [cubic] * 2 + [stop], [(20.0, 1.0)] * 2, np.ones(3),
        np.array([0.02] * 4 + [0.0] * 3), rows, lambda t: np.array([0.0, np.cos(t), 0.0]), 60.0, np.arange(240) * 0.25,
    )  # fmt: skip
    for i in range(3):
        np.testing.assert_allclose(found[f"observable/displacement.q{i + 1}"][:240], x[:, i], rtol=0, atol=1e-9)
    assert found["event/time"].size > 20


MANY = (
    "&mass name='a', value=1.0 /", "&mass name='b', value=0.7 /",
    "&spring between='a','frame', stiffness=1.0 /", "&spring between='a','b', stiffness=3.0, damping=0.02 /",
    "&spring name='j1', between='a','frame', law='jenkins', stiffness=2.0, slip_force=0.5 /",
    "&spring name='j2', between='a','b', law='jenkins', stiffness=1.0, slip_force=0.3, damping=0.03 /",
    "&spring name='j3', between='a','frame', law='jenkins', stiffness=0.9, slip_force=0.2 /",
    "&stop name='wall', between='b','frame', side='upper', clearance=0.6, law='rigid', restitution=0.7 /",
    "&friction name='rub', between='a','frame', static_coefficient=0.1, normal_load=1.0 /",
    "&stop name='soft', between='a','frame', side='lower', clearance=0.4, stiffness=20.0 /",
    "&load on='a', amplitude=1.6, angular_frequency=1.3 /",
    "&record what='trajectory', observable='displacement', of='b', interval=0.05 /",
    "&record what='trajectory', observable='relative_displacement', of='j2', interval=0.05 /",
    "&record what='trajectory', observable='displacement', of='a', interval=0.05 /",
)  # fmt: skip


def test_beside_walls_and_friction_two_methods_agree(folder, tmp_path):
    both = []
    for method in ("exact", "dop853"):
        path = case(tmp_path, *MANY, motion=f"t_end=40.0, integrator='{method}', start='zero'")
        found = run(path, *(TIGHT if method != "exact" else ()))
        a, b = found["observable/displacement.a"], found["observable/displacement.b"]
        np.testing.assert_allclose(found["observable/relative_displacement.j2"], a - b, rtol=0, atol=1e-14)
        both.append((b, found["event/state"]))
    np.testing.assert_allclose(both[0][0], both[1][0], rtol=0, atol=1e-10)
    # Where two sliders come to rest at once they are listed in any order.
    assert np.array_equal(np.bincount(both[0][1]), np.bincount(both[1][1]))
    assert both[0][1].size > 100


def test_a_planar_joint_is_the_lumped_one(folder, tmp_path):
    spring = "&spring name='slider', between='{}','frame', {} law='jenkins', stiffness=2.0, slip_force=0.5 /"
    motion = "t_end=40.0, integrator='exact', start='zero'"
    record = "&record what='trajectory', observable='displacement', of='{}', interval=0.05 /"
    line = run(case(
        tmp_path, "&mass name='m', value=1.0 /", "&spring between='m','frame', stiffness=1.0 /", spring.format("m", ""),
        "&load on='m', amplitude=1.0, angular_frequency=1.3 /", record.format("m"), motion=motion,
    ))["observable/displacement.m"]  # fmt: skip
    plane = run(case(
        tmp_path, "&body name='m', mass=1.0, inertia=1.0 /",
        "&spring between='m','frame', direction=1.0,0.0, stiffness=1.0 /",
        "&spring between='m','frame', direction=0.0,1.0, stiffness=1.0 /", spring.format("m", "direction=1.0,0.0,"),
        "&load on='m.x', amplitude=1.0, angular_frequency=1.3 /", record.format("m.x"), motion=motion,
    ))["observable/displacement.m.x"]  # fmt: skip
    np.testing.assert_allclose(plane, line, rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("program", "change", "says"),
    [
        ("razy-run", ("slip_force=0.5", ""), "the force at which it slides"),
        ("razy-run", ("slip_force=0.5", "slip_force=0.0"), "a positive real number"),
        ("razy-run", ("law='jenkins', ", ""), "it belongs to 'jenkins'"),
        ("razy-run", ("stiffness=2.0, ", ""), "the stiffness in N/m"),
        ("razy-run", ("stiffness=2.0, ", "stiffness=0.0, "), "stiffness = 0.0: positive with law = 'jenkins'"),
        ("razy-run", ("'zero' /", "'static' /\n&load on='m', value=3.0 /"), "in no equilibrium: balance them"),
        ("razy-modes", ("&follow", f"{RECORD}&modes count=1 /\n&response points=9,"), "and no Jenkins element"),
        ("razy-run", ("'exact'", "'moreau_jean', step=0.01"), "a Jenkins element slides"),
        ("razy-run", ("'exact'", "'dop853', treatment='smoothing'"), "'event' will do"),
        ("razy-run", ("'exact'", "'exact', lyapunov=1"), "a Jenkins element"),
        ("razy-follow", ("'exact'", "'exact'"), "take razy-sweep"),
    ],
)
def test_what_is_refused(folder, tmp_path, program, change, says):
    path = case(
        tmp_path, "&mass name='m', value=1.0 /", "&load on='m', amplitude=1.0, angular_frequency=1.3 /",
        "&spring name='slider', between='m','frame', law='jenkins', stiffness=2.0, slip_force=0.5 /",
        "&follow parameter='load%angular_frequency', first=1.0, last=2.0 /",
        motion="t_end=40.0, integrator='exact', start='zero'",
    )  # fmt: skip
    path.write_text(path.read_text().replace(*change))
    done = start(program, path)
    assert done.returncode == 2
    assert says in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


@pytest.mark.parametrize("method", ["exact", "dop853"])
def test_a_start_beyond_the_limit(folder, tmp_path, method):
    """The slider stands where its spring just holds it: swings about there, up to the limit on the other side."""
    path = case(
        tmp_path, "&mass name='m', value=2.0 /", "&initial on='m', displacement=0.02, velocity=-0.03 /",
        "&spring name='slider', between='m','frame', law='jenkins', stiffness=50.0, slip_force=0.5 /",
        "&record what='trajectory', observable='displacement', interval=0.05 /",
        motion=f"t_end=1.0, integrator='{method}', start='given'",
    )  # fmt: skip
    found = run(path, *(TIGHT if method != "exact" else ()))
    w, edge, speed = 5.0, 0.01, 0.03
    # edge cos wt - speed/w sin wt = -edge.
    slides = 2 * np.arctan2(edge, speed / w) / w
    now = found["observable/time"]
    x = edge + edge * np.cos(w * now) - speed / w * np.sin(w * now)
    np.testing.assert_allclose(found["observable/displacement"][now < slides], x[now < slides], rtol=0, atol=1e-12)
    assert found["event/time"] == pytest.approx([slides, slides + speed / 0.25], rel=1e-10)
    assert found["event/state"].tolist() == [3, 1]


def machine_of(seed):
    """Return masses in a row with sliders, stops and friction, shaken."""
    random = np.random.default_rng(seed)
    names = [f"m{i}" for i in range(random.integers(1, 4))]
    ends = [(name, ["frame", *names][i]) for i, name in enumerate(names)]
    groups = []
    for i, (one, other) in enumerate(ends):
        groups.append(f"&mass name='{one}', value={random.uniform(0.3, 3.0):.3f} /")
        groups.append(f"&spring between='{one}','{other}', stiffness={random.uniform(0.5, 6.0):.3f}, damping=0.03 /")
        for k in range(2):
            stiffness, limit = random.uniform(0.5, 20.0), random.uniform(0.05, 1.0)
            groups.append(
                f"&spring name='j{i}{k}', between='{one}','{other}', law='jenkins', stiffness={stiffness:.3f}, "
                f"slip_force={limit:.3f} /"
            )
    law = ("stiffness=30.0, damping=0.5", "law='rigid', restitution=0.6")[seed % 2]
    groups.append(f"&stop name='s', between='{one}','frame', side='both', clearance=0.3, {law} /")
    groups.append(f"&friction name='f', between='{names[0]}','frame', static_coefficient=0.1, normal_load=1.0 /")
    shape = ("", "shape='square', ")[seed // 2 % 2]
    force, hertz = random.uniform(0.5, 3.0), random.uniform(0.08, 0.5)
    groups.append(f"&load on='{one}', amplitude={force:.3f}, {shape}frequency={hertz:.4f} /")
    return [*groups, f"&record observable='displacement', of='{one}', what='trajectory', interval=0.1 /"]


@pytest.mark.parametrize("seed", range(8))
def test_random_machines(folder, tmp_path, seed):
    found = []
    for method in ("exact", "dop853"):
        path = case(tmp_path, *machine_of(seed), motion=f"t_end=20.0, integrator='{method}', start='zero'")
        found.append(run(path, *(TIGHT if method != "exact" else ())))
    x, y = (one[name] for one in found for name in one if name.startswith("observable/displacement"))
    np.testing.assert_allclose(x, y, rtol=0, atol=1e-9 * np.max(np.abs(x)))
    assert found[0]["event/time"].size > 10
