"""A shaft in a round hole: `&ring` and friction on it, against closed forms and SciPy."""

from functools import partial
from itertools import combinations
from typing import NamedTuple

import h5py
import numpy as np
import pytest
from programs import SOURCE, plot, start, succeed
from programs import run as arrays
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, minimize_scalar

RUB = SOURCE / "inputs" / "annular_rub.nml"
RPM = 30 / np.pi
DISK = """
&scene kind='planar' /
&body name='disk', mass=1.0, inertia=1.0 /
&spring between='disk','frame', direction=1,0, stiffness=1.0 /
&spring between='disk','frame', direction=0,1, stiffness=1.0 /
"""


def run(path, text):
    path.write_text(text)
    succeed("razy-run", path, "--force")
    return h5py.File(path.with_suffix(".h5").name)


class FullRub(NamedTuple):
    """z'' + d z' + z + k (1 - 1/|z|)(1 + i mu) z [|z| > 1] = e W² exp(i W t), touched all the time."""

    stiffness: float
    friction: float
    damping: float
    moment: float

    def text(self):
        old = {"stiffness=4.0": self.stiffness, "static_coefficient=0.1": self.friction, "moment=0.3": self.moment}
        text = RUB.read_text().replace(
            "damping_matrix=0.1,0.0,0.0,0.1", f"damping_matrix={self.damping},0,0,{self.damping}"
        )
        text = text.replace("=1.0e-12, absolute_tolerance=1.0e-13", "=1.0e-13, absolute_tolerance=1.0e-14")
        for entry, value in old.items():
            assert entry in text
            text = text.replace(entry, f"{entry.split('=')[0]}={value}")
        return text

    def needed(self, speed, r):
        """The force over exp(i phase) that a full rub of radius r needs."""
        return self.free(speed) * r + self.stiffness * (r - 1) * (1 + 1j * self.friction)

    def free(self, speed):
        return 1 - speed**2 + 1j * self.damping * speed

    def radii(self, speed):
        """Discriminant and both roots of |needed|² = (e speed²)², a square equation for the radius of a full rub."""
        at_rest = self.needed(speed, 0.0)
        slope = self.needed(speed, 1.0) - at_rest
        b = (slope.conjugate() * at_rest).real / abs(slope) ** 2
        c = (abs(at_rest) ** 2 - (self.moment * speed**2) ** 2) / abs(slope) ** 2
        return b * b - c, [-b + sign * np.sqrt(max(b * b - c, 0.0)) for sign in (-1, 1)]

    def exponents(self, speed, r):
        """Characteristic exponents of a full rub of radius r, in the frame that turns with it."""
        u = r * self.moment * speed**2 / self.needed(speed, r)
        c = self.stiffness * (1 + 1j * self.friction)
        a = self.free(speed) + c * (1 - 1 / (2 * r))
        b = c * u**2 / (2 * r**3)
        g = 2j * speed + self.damping
        matrix = np.zeros((4, 4))
        matrix[:2, 2:] = np.eye(2)
        matrix[2:, :2] = [[-a.real - b.real, a.imag - b.imag], [-a.imag - b.imag, -a.real + b.real]]
        matrix[2:, 2:] = [[-g.real, g.imag], [-g.imag, -g.real]]
        return np.linalg.eigvals(matrix)

    def torus(self, which, speed):
        """Product of the sums of two exponents, 0 where a torus is born; not asked for where nothing rubs."""
        discriminant, roots = self.radii(speed)
        if discriminant <= 0 or roots[which] <= 1:
            return np.nan
        return np.prod([a + b for a, b in combinations(self.exponents(speed, roots[which]), 2)]).real

    def points(self):
        """Where the whirl without rub has the radius 1, folds, and births of tori."""
        return {
            "GR": roots_of(lambda speed: abs(self.free(speed)) - self.moment * speed**2),
            "LP": roots_of(lambda speed: self.radii(speed)[0]),
            "TR": roots_of(partial(self.torus, 0)) + roots_of(partial(self.torus, 1)),
        }


def roots_of(function):
    speeds = np.linspace(0.5, 3.2, 1000)
    values = [function(speed) for speed in speeds]
    changes = [i for i in range(len(speeds) - 1) if values[i] * values[i + 1] < 0]
    return [brentq(function, speeds[i], speeds[i + 1], xtol=1e-15) for i in changes]


def test_a_touch_all_round_that_a_step_goes_over(folder):
    """Found to rounding from steps that begin far off, too; along its curve the free whirl is as wide as the gap."""
    text = (SOURCE / "inputs/annular_rub.nml").read_text()
    for old, new in (
        ("damping_matrix=0.1,0.0,0.0,0.1", "damping_matrix=0.2,0.0,0.0,0.2"), ("stiffness=4.0", "stiffness=2.0"),
        ("speed_rpm=9.3", "speed_rpm=8.0"), ("first=7.0, last=30.0", "first=6.0, last=16.0, max_points=70"),
    ):  # fmt: skip
        assert text.count(old) == 1
        text = text.replace(old, new)
    (folder / "round.nml").write_text(text + "&follow parameter='ring%clearance', first=0.8, last=1.2 /\n")
    succeed("razy-follow", "round.nml")
    with h5py.File("round.h5") as file:
        assert file["special/label"][0] == b"GR"
        speeds = np.append(file["curve_point/rotation.speed_rpm"][:], file["special/parameter"][0]) / RPM
        gaps = np.append(file["curve_point/ring.clearance"][:], 1.0)
    assert (gaps.min(), gaps.max()) == (0.8, 1.2)
    np.testing.assert_allclose(0.3 * speeds**2 / np.hypot(1 - speeds**2, 0.2 * speeds), gaps, rtol=1e-10)


@pytest.mark.parametrize("labels, rub", [
    ("GR TR LP TR GR EP", FullRub(10.83, 0.19, 0.31, 0.44)),
    ("GR LP GR EP", FullRub(10.51, 0.0, 0.35, 0.41)),
    ("GR TR EP", FullRub(25.62, 0.1, 0.23, 0.34)),
])  # fmt: skip
def test_full_rub_against_closed_form(folder, labels, rub):
    (folder / "rub.nml").write_text(rub.text())
    succeed("razy-follow", "rub.nml")
    with h5py.File("rub.h5") as file:
        found = [label.decode() for label in file["special/label"][:]]
        values = file["special/parameter"][:] / RPM
        speeds = file["point/rotation.speed_rpm"][:] / RPM
        multipliers = file["point/multiplier"][:, 0] + 1j * file["point/multiplier"][:, 1]
        largest = np.hypot(*file["point/state"][:, :2].T)
    points = rub.points()
    for label, value in zip(found, values, strict=True):
        assert label == "EP" or min(abs(value / right - 1) for right in points[label]) < 1e-11
    assert " ".join(found) == labels
    compared = unstable = 0
    for speed, multiplier, r in zip(speeds, multipliers, largest, strict=True):
        # By the equation, as the radius itself is not to be had to these digits at the fold.
        there = rub.needed(speed, r) if r > 1 else rub.free(speed) * r
        assert abs(abs(there) / (rub.moment * speed**2) - 1) < 1e-11
        if r < 1.001:
            continue
        here = np.exp(rub.exponents(speed, r) * 2 * np.pi / speed)
        size = max(1, np.abs(here).max())
        assert max(np.abs(here - one).min() for one in multiplier) < 1e-9 * size
        compared += 1
        unstable += np.abs(here).max() > 1
    assert compared > 30 and unstable > 20


def test_ring_against_scipy(tmp_path):
    text = DISK + (
        "&ring name='ring', between='disk','frame', clearance=0.5, offset=0.2,-0.1, stiffness=50.0 /\n"
        "&load on='disk.x', amplitude=0.8, angular_frequency=0.7 /\n"
        "&initial on='disk.x', displacement=0.3 /\n&initial on='disk.y', velocity=0.9 /\n"
        "&motion t_end=30.0, start='given', relative_tolerance=1e-12, absolute_tolerance=1e-14 /\n"
        "&record observable='state', what='trajectory', interval=1.0 /\n"
    )
    with run(tmp_path / "ring.nml", text) as file:
        ours = file["state/displacement"][:, :2]
        events = file["event/time"].size

    def field(t, z, closed):
        d = z[:2] - [0.2, -0.1]
        r = np.hypot(*d)
        push = -50 * (r - 0.5) / r * d if closed else np.zeros(2)
        return np.concatenate([z[2:], push - z[:2] + [0.8 * np.sin(0.7 * t), 0.0]])

    t, z, pieces = 0.0, np.array([0.3, 0.0, 0.0, 0.9]), []
    closed, count = False, 0
    while t < 30:

        def gap(_, z):
            return np.hypot(z[0] - 0.2, z[1] + 0.1) - 0.5

        gap.terminal, gap.direction = True, -1.0 if closed else 1.0
        part = solve_ivp(
            lambda t, z, closed=closed: field(t, z, closed), (t, 30.0), z, "DOP853", events=gap, dense_output=True,
            rtol=1e-13, atol=1e-15,
        )  # fmt: skip
        pieces.append(part.sol)
        t, z = part.t[-1], part.y[:, -1]
        if part.status == 1:
            closed, count = not closed, count + 1
    theirs = []
    for time in range(31):
        sol = next(s for s in pieces if s.t_min - 1e-12 <= time <= s.t_max + 1e-12)
        theirs.append(sol(time)[:2])
    assert events == count > 20
    assert np.abs(ours - theirs).max() < 1e-9


def rotor_in_stator(angle, speed, extra=""):
    u, v = float(1.3 * np.cos(angle)), float(1.3 * np.sin(angle))
    text = RUB.read_text().split("&unbalance")[0]
    return text + (
        f"&rotation speed_rpm={float(speed * RPM)!r} /\n"
        "&ring name='stator', between='rotor.2','frame', clearance=1.0, stiffness=4.0 /\n"
        "&friction name='rub', between='rotor.2','frame', normal_contact='stator', radius=0.9, "
        "static_coefficient=0.3 /\n"
        f"&initial on='rotor.2.v', displacement={u!r} /\n&initial on='rotor.2.w', displacement={v!r} /\n"
        "&motion t_end=6.0, start='given', relative_tolerance=1e-12, absolute_tolerance=1e-14 /\n"
        "&record observable='displacement', of='rotor.2.v', what='trajectory', interval=0.5 /\n"
        "&record observable='displacement', of='rotor.2.w', what='trajectory', interval=0.5 /\n" + extra
    )


def path_of(file):
    return file["observable/displacement.rotor.2.v"][:] + 1j * file["observable/displacement.rotor.2.w"][:]


def rubbing(surface, sign):
    """Return the motion's equations for a surface of this speed over time, with this sign of the speed of sliding."""

    def field(t, z):
        d, v = z[:2], z[2:]
        r = np.hypot(*d)
        force = -d - 0.1 * v
        if r > 1:
            n = d / r
            around = np.array([-n[1], n[0]])
            force = force - 4 * (r - 1) * (n + 0.3 * sign(around @ v + surface(t)) * around)
        return np.concatenate([v, force])

    return field


def test_a_hole_that_moves_as_given(tmp_path):
    """A body so heavy that nothing holds it up, driven by its mass times the acceleration, beside the given motion."""
    w, a = 1.3, 0.4
    text = DISK + (
        "&body name='table', mass=1e12, inertia=1e12 /\n"
        "&ring name='ring', between='disk','table', clearance=0.5, stiffness=50.0, damping=0.5 /\n"
        f"&load on='table.x', amplitude={-1e12 * a * w**2!r}, angular_frequency={w} /\n"
        f"&initial on='table.x', velocity={a * w!r} /\n&initial on='disk.y', velocity=0.9 /\n"
        "&motion t_end=20.0, start='given', relative_tolerance=1e-12, absolute_tolerance=1e-14 /\n"
        "&record observable='state', what='trajectory', interval=1.0 /\n"
    )
    with run(tmp_path / "moved.nml", text) as file:
        ours, events = file["state/displacement"][:, :2], file["event/time"].size

    def field(t, z):
        d, v = z[:2] - [a * np.sin(w * t), 0.0], z[2:] - [a * w * np.cos(w * t), 0.0]
        r = np.hypot(*d)
        push = max(0.0, 50 * (r - 0.5) + 0.5 * (d @ v) / r) if r > 0.5 else 0.0
        return np.concatenate([z[2:], -push * d / r - z[:2] if r > 0 else -z[:2]])

    right = solve_ivp(field, (0.0, 20.0), [0.0, 0.0, 0.0, 0.9], "DOP853", np.arange(21.0), rtol=1e-11, atol=1e-13,
                      max_step=2e-3)  # fmt: skip
    assert events > 10
    assert np.abs(ours - right.y[:2].T).max() < 1e-7


def test_friction_opposes_sliding_at_every_angle_and_spin(tmp_path):
    field = rubbing(lambda t: 0.9 * 2.0, np.sign)
    theirs = solve_ivp(field, (0, 6), [1.3, 0, 0, 0], "DOP853", t_eval=np.arange(0, 6.25, 0.5), rtol=1e-12, atol=1e-13,
                       max_step=0.002)  # fmt: skip
    theirs = theirs.y[0] + 1j * theirs.y[1]
    for k in range(16):
        angle = k * np.pi / 8
        for spin in (1, -1):
            with run(tmp_path / "angle.nml", rotor_in_stator(angle, 2.0 * spin)) as file:
                ours = path_of(file) * np.exp(-1j * angle)
            # The mirror image for the other spin.
            ours = ours if spin > 0 else ours.conj()
            assert np.abs(ours - theirs).max() < 1e-8
            if k == 0 and spin > 0:
                first = ours
            assert np.abs(ours - first).max() < 1e-11


def test_friction_in_a_run_up(tmp_path):
    # The surface at 0.9 turns with 0.4 (t - 2): it slides backward, may stick, and slides forward.
    field = rubbing(lambda t: 0.9 * 0.4 * (t - 2), lambda slide: np.tanh(slide / 1e-6))
    theirs = solve_ivp(field, (0, 6), [1.3, 0, 0, 0], "Radau", t_eval=np.arange(0, 6.25, 0.5), rtol=1e-9, atol=1e-12)
    text = rotor_in_stator(0.0, -0.8).replace("&rotation ", f"&rotation acceleration_rpm_per_s={0.4 * RPM!r}, ")
    text += "&record observable='sliding_velocity', of='rub', what='trajectory', interval=0.5 /\n"
    with run(tmp_path / "up.nml", text) as file:
        ours = path_of(file)
        slide = file["observable/sliding_velocity.rub"][:]
    assert np.abs(ours - (theirs.y[0] + 1j * theirs.y[1])).max() < 1e-5
    around = (theirs.y[0] * theirs.y[3] - theirs.y[1] * theirs.y[2]) / np.hypot(*theirs.y[:2])
    expected = -(around + 0.9 * 0.4 * (theirs.t - 2))
    assert np.abs(slide - expected).max() < 1e-4


def test_energy_goes_where_friction_says(tmp_path):
    text = DISK + (
        "&ring name='ring', between='disk','frame', clearance=1.0, stiffness=40.0 /\n"
        "&friction name='rub', between='disk','frame', normal_contact='ring', static_coefficient=0.2 /\n"
        "&initial on='disk.x', displacement=0.8, velocity=1.5 /\n&initial on='disk.y', velocity=2.0 /\n"
        "&motion t_end=10.0, start='given', relative_tolerance=1e-12, absolute_tolerance=1e-14 /\n"
        "&record observable='state', what='trajectory', interval=10.0 /\n"
        "&record observable='contact_force', of='ring', what='trajectory', interval=10.0 /\n"
        "&record observable='contact_force', of='rub', what='statistics' /\n"
    )
    with run(tmp_path / "energy.nml", text) as file:
        q, v = file["state/displacement"][:, :2], file["state/velocity"][:, :2]
        lost = file["contact/rub/dissipated_energy"][()]
        force = file["observable/contact_force.ring"][:]
        assert file["outcome/residual"][0] < 1e-9 and file["outcome/unbalanced"][0] == 0
    energy = ((q**2).sum(1) + (v**2).sum(1) + force**2 / 40) / 2
    assert lost > 0.5
    assert abs(energy[0] - energy[-1] - lost) < 1e-9 * energy[0]


# Backward whirl without slip: r w = R W, and m w^2 = k + kc (1 - clearance/r) at the radius r.
SURFACE, GAP = 0.25, 4e-4


def rolling(t_end, since, how=""):
    return (
        "&scene kind='planar' /\n&body name='disk', mass=2.0, inertia=1.0 /\n"
        "&spring between='disk','frame', direction=1,0, stiffness=1e5, damping=44.72 /\n"
        "&spring between='disk','frame', direction=0,1, stiffness=1e5, damping=44.72 /\n"
        f"&ring name='ring', between='disk','frame', clearance={GAP}, stiffness=1e7 /\n"
        "&friction name='rub', between='disk','frame', normal_contact='ring', static_coefficient=0.2, "
        f"belt_speed={-SURFACE} /\n"
        "&initial on='disk.x', displacement=4.2e-4 /\n&initial on='disk.y', velocity=-0.2 /\n"
        f"&motion t_end={t_end}, start='given', relative_tolerance=1e-12, absolute_tolerance=1e-16{how} /\n"
        f"&record observable='state', what='trajectory', from={since}, interval=0.001 /\n"
        f"&record observable='sliding_velocity', of='rub', what='trajectory', from={since}, interval=0.001 /\n"
        f"&record observable='contact_force', of='rub', what='trajectory', from={since}, interval=0.001 /\n"
        "&record observable='contact_force', of='all', what='statistics', from=0.001 /\n"
    )


def test_shaft_rolls_in_the_ring(tmp_path):
    r = brentq(lambda r: 2 * (SURFACE / r) ** 2 - 1e5 - 1e7 * (1 - GAP / r), GAP, 5 * GAP, xtol=1e-18, rtol=1e-15)
    text = rolling(2.0, 1.9)
    with run(tmp_path / "roll.nml", text) as file:
        d, v = file["state/displacement"][:, :2], file["state/velocity"][:, :2]
        slip = file["observable/sliding_velocity.rub"][:]
        force = file["observable/contact_force.rub"][:]
        assert file["event/state"][:].tolist() == [3]
        assert "contact/ring/sticking_share" not in file
        rolled = (2.0 - file["event/time"][0]) / 1.999
        assert abs(file["contact/rub/sticking_share"][()] - rolled) < 1e-12 and rolled < 1.0
    radius = np.hypot(*d.T)
    whirl = (d[:, 0] * v[:, 1] - d[:, 1] * v[:, 0]) / radius**2
    assert np.abs(slip).max() < 1e-12
    assert np.abs(radius / r - 1).max() < 1e-7
    assert np.abs(whirl + SURFACE / r).max() < 1e-7 * SURFACE / r
    # Friction carries what the dampers take.
    assert np.abs(np.abs(force) / (44.72 * SURFACE) - 1).max() < 1e-5


def test_shaft_rolls_in_the_ring_by_an_implicit_method(tmp_path):
    """Its matrix knows how the direction of what sticks turns: 66 are enough, of which it takes 293 without that."""
    states = []
    for method in ("dop853", "radau5"):
        with run(tmp_path / f"{method}.nml", rolling(0.03, 0.02, f", integrator='{method}'")) as file:
            states.append(file["state/displacement"][:, :2])
            assert file["outcome/jacobians"][0] < 100
            assert file["event/state"][:].tolist() == [3]
    assert np.abs(states[0] - states[1]).max() < 1e-9 * np.abs(states[0]).max()


@pytest.mark.parametrize("offset", [(0.0, 0.0), (0.3, 0.2)])
def test_shaft_rests_in_the_ring(tmp_path, offset):
    text = DISK + (
        f"&ring name='ring', between='disk','frame', clearance=0.5, offset={offset[0]},{offset[1]}, stiffness=30.0 /\n"
        "&load on='disk.x', value=1.0 /\n&load on='disk.y', value=-2.0 /\n"
        "&motion t_end=5.0, start='static' /\n"
        "&record observable='state', what='trajectory', interval=5.0 /\n"
    )
    with run(tmp_path / "rest.nml", text) as file:
        q = file["state/displacement"][:, :2]
    d = q[0] - offset
    r = np.hypot(*d)
    assert r > 0.5
    assert np.abs(q[0] + 30 * (r - 0.5) * d / r - [1.0, -2.0]).max() < 1e-11
    assert np.abs(q[-1] - q[0]).max() < 1e-10


def test_response_in_the_ring(tmp_path):
    """Orders of peaks, what API 617 asks of order 1 alone, and the largest orbit beside the gap, by the closed form."""
    path = tmp_path / "response.nml"
    kept = [
        line
        for line in RUB.read_text().splitlines()
        if not line.startswith(("&friction", "&follow", "&motion", "&record"))
    ]
    path.write_text(
        "\n".join(kept).replace("clearance=1.0,", "clearance=10.0, offset=0.0,4.0,")
        + """
&load on='rotor.2.v', amplitude=0.01, order=2.0 /
&modes count=2 /
&record observable='displacement', of='rotor.2.v', what='extrema' /
&response parameter='rotation%speed_rpm', first=1.0, last=30.0, points=301, operating=20.0,25.0 /
"""
    )
    said = succeed("razy-modes", path, "--force").stdout
    with h5py.File("response.h5") as file:
        group = {name: file[f"response/{name}"][()] for name in file["response"] if name != "phasor"}
    assert sorted(group["peak_order"]) == pytest.approx([1.0, 2.0])
    first = np.argmin(group["peak_order"])
    for name in ("amplification_factor", "required_margin", "margin_left"):
        assert list(np.isnan(group[name])) == list(group["peak_order"] > 1.5)
    assert group["margin_left"][first] == group["separation_margin"][first] - group["required_margin"][first]
    speed = group["parameter"] / RPM

    def orbit(speed):
        once = 0.3 * speed**2 / abs(1 - speed**2 + 0.1j * speed)
        return once + 0.01 / abs(1 - 4 * speed**2 + 0.2j * speed)

    # Between the points, where it is larger than at any of them.
    largest = minimize_scalar(lambda speed: -orbit(speed), bounds=(0.9, 1.1), method="bounded", options={"xatol": 1e-9})
    assert -largest.fun > max(orbit(speed)) * (1 + 1e-6)
    assert group["ring_orbit"] == pytest.approx([-largest.fun], rel=1e-9)
    assert group["ring_parameter"] == pytest.approx([largest.x * RPM], rel=1e-6)
    assert group["ring_gap"] == pytest.approx([6.0])
    assert group["ring_share"] == pytest.approx(group["ring_orbit"] / 6.0)
    assert "order 2.0\n" in said
    assert "largest orbit in stator" in said


def test_a_pin_in_a_bush_and_its_pictures(folder):
    """Pressed against the hole all round by its unbalance, with friction on a surface that turns ahead of the whirl."""
    found = arrays(
        SOURCE / "inputs" / "bush.nml", "--set", "motion%t_end=1.2", *(f"--set=record({i})%from=1.0" for i in (1, 2, 3))
    )
    x, y = (np.ravel(found[f"observable/displacement.pin.{way}"]) for way in "xy")
    w = 210.0

    def missing(r):
        return abs((4.0e4 - w**2 + 60j * w) * r + 1.0e6 * (r - 1.0e-4) * (1 + 0.1j)) - 1.2e-4 * w**2

    np.testing.assert_allclose(np.hypot(x, y), brentq(missing, 1.0e-4, 2.0e-4, xtol=1e-16), rtol=1e-7)
    for kind in ("orbit", "machine"):
        done = plot("run.h5", "--kind", kind, "--save", f"{kind}.svg")
        assert done.returncode == 0, done.stderr
    text = (SOURCE / "inputs" / "bush.nml").read_text().replace("of='pin.y'", "of='pin.phi'")
    (folder / "other.nml").write_text(text)
    succeed("razy-run", "other.nml")
    done = plot("other.h5", "--kind", "orbit", "--save", "other.svg")
    assert "or of PLACE.x and PLACE.y" in done.stderr


def test_modes_with_the_ring_open(tmp_path):
    """A ring is open at rest, whatever else is closed; pressed in its equilibrium it has no linear stiffness."""
    ring = "&ring name='ring', between='disk','frame', clearance=0.5, stiffness=30.0 /\n"
    stop = "&stop name='stop', between='disk','frame', direction=0,1, stiffness=8.0 /\n"
    path = tmp_path / "modes.nml"
    path.write_text(DISK + ring + stop + "&modes count=3 /\n")
    succeed("razy-modes", path)
    with h5py.File("modes.h5") as file:
        found = 2 * np.pi * file["natural_frequency"][()]
    assert found == pytest.approx([0.0, 1.0, 3.0], abs=1e-9)
    path.write_text(DISK + ring + "&load on='disk.x', value=1.0 /\n&modes count=3, contacts='equilibrium' /\n")
    done = start("razy-modes", path, "--force")
    assert done.returncode == 2 and "&modes contacts = 'equilibrium': 'open': the contact ring " in done.stderr


def test_a_ring_without_a_gap_is_within_no_bound(tmp_path):
    """An offset as large as the clearance, or larger: no share of the gap, so that a sheet that bounds it misses it."""
    kept = [line for line in RUB.read_text().splitlines() if not line.startswith(("&friction", "&follow", "&motion"))]
    more = """
&modes count=2 /
&response parameter='rotation%speed_rpm', first=1.0, last=30.0, points=301 /
"""
    path = tmp_path / "gone.nml"
    for offset in (1.0, 2.0):
        path.write_text("\n".join(kept).replace("clearance=1.0,", f"clearance=1.0, offset={offset},0.0,") + more)
        said = succeed("razy-modes", path, "--force").stdout
        assert "leaves no gap" in said and "NaN" not in said
        with h5py.File("gone.h5") as file:
            assert np.isnan(file["response/ring_share"][()]).all()
            assert file["response/ring_gap"][()] == pytest.approx([1.0 - offset])


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("clearance=1.0,", "clearance=-1.0,", "&ring clearance = -1.0: "),
        ("stiffness=4.0 /", "law='rigid', restitution=0.5 /", "&ring law = 'rigid': one that gives way"),
        (
            "normal_contact='stator',",
            "normal_contact='stator', direction=0,1,0,",
            "&friction direction = ",
        ),
        ("between='rotor.2','frame', normal", "between='rotor.1','frame', normal", "&friction between = "),
        ("absolute_tolerance=1.0e-13 /", "integrator='exact' /", "&motion integrator = 'exact': a Runge-Kutta method"),
        ("absolute_tolerance=1.0e-13 /", "integrator='moreau_jean', step=1e-3 /", "where there is a &ring"),
    ],
)
def test_refusals(tmp_path, old, new, said):
    text = RUB.read_text()
    assert old in text
    (tmp_path / "bad.nml").write_text(text.replace(old, new))
    done = start("razy-run", tmp_path / "bad.nml")
    assert done.returncode == 2
    assert said in done.stderr
    assert done.stderr.count("\n") == 1
