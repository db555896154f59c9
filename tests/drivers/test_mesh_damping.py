"""Where the damping of a gear mesh acts: against closed forms, piece by piece, and beside a damper of its own."""

import numpy as np
import pytest
from programs import run, start

# Two equal wheels, 40 teeth at 60 rpm: m d'' + F(d, d') = 0 with m = I/(2 r²).
INERTIA, RADIUS, STIFFNESS, DAMPING, BACKLASH = 0.01, 0.1, 2.0e5, 60.0, 1.0e-4
MASS = INERTIA / (2 * RADIUS**2)
WHEELS = """&scene kind='lumped' /
&inertia name='a', value=0.01 /
&inertia name='b', value=0.01 /
&gear_mesh name='mesh', between='a','b', radius=0.1,0.1, teeth=40,40, stiffness=2e5, damping=60.0, backlash=1e-4{keys} /
&rotation speed_rpm=60.0, of='a' /
&initial on='a', displacement={start}, velocity={speed} /
&motion t_end={t_end}, start='given', integrator='{integrator}', relative_tolerance=1e-13, absolute_tolerance=1e-20 /
&record observable='mesh_deformation', what='trajectory', interval={interval!r} /
&record observable='contact_force', what='trajectory','statistics', interval={interval!r} /
"""
METHODS = ["exact", "dop853"]


def motion(folder, keys="", integrator="exact", t_end=0.01, start=-2e-5, speed=0.8):
    """`start` and `speed` are those of d, in m and m/s."""
    numbers = {"t_end": float(t_end), "interval": float(t_end / 500), "start": start / RADIUS, "speed": speed / RADIUS}
    text = WHEELS.format(keys=keys, integrator=integrator, **numbers)
    (folder / "wheels.nml").write_text(text)
    return run("wheels.nml")


def last(found):
    return np.ravel(found["observable/mesh_deformation"])[-1]


def smallest_force(found):
    return np.ravel(found["observable/contact_force"]).min()


def free(d, v, t, spring=STIFFNESS, damping=DAMPING):
    """State after t of m p'' + b p' + k p = 0, from the eigenvectors of its matrix."""
    matrix = np.array([[0.0, 1.0], [-spring / MASS, -damping / MASS]])
    value, vector = np.linalg.eig(matrix)
    return (vector @ (np.exp(value * t) * np.linalg.solve(vector, np.array([d, v], complex)))).real


def when(function, low, high):
    """The moment at which a function of time changes its sign."""
    below = function(low) < 0
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if (function(middle) < 0) == below else (low, middle)
    return low


@pytest.mark.parametrize("integrator", METHODS)
def test_limited_by_the_force_of_the_spring(folder, integrator):
    """Twice the spring's force while b p' > k p, then k p + b p' down to zero, then none."""
    v = 0.8
    t = 2e-5 / v
    fast = np.sqrt(2 * STIFFNESS / MASS)
    limit = np.arctan(DAMPING * fast / STIFFNESS) / fast
    p, w = v / fast * np.sin(fast * limit), v * np.cos(fast * limit)
    assert DAMPING * w == pytest.approx(STIFFNESS * p, rel=1e-12)
    until = when(lambda x: STIFFNESS * free(p, w, x)[0] + DAMPING * free(p, w, x)[1], 1e-6, 6e-3)
    q, out = free(p, w, until)
    assert q > 0 > out
    for at in (0.5 * limit, limit + 0.3 * until, limit + until - 0.5 * q / out):
        x = at - limit
        later = free(p, w, x)[0] if x < until else q + (x - until) * out
        expected = v / fast * np.sin(fast * at) if x < 0 else later
        found = motion(folder, ", damping_acts='limited'", integrator, t_end=t + at)
        assert last(found) == pytest.approx(expected, abs=1e-9 * p), at
    # Over the backlash to the back flanks and away from them: each impact takes the same share of the speed.
    share = -out / v
    contact = limit + until - q / out
    end = t + contact - BACKLASH / out + contact + 1e-4
    found = motion(folder, ", damping_acts='limited'", integrator, t_end=end)
    assert smallest_force(found) < -100.0
    expected = -BACKLASH + share**2 * v * 1e-4
    assert expected < 0
    assert last(found) == pytest.approx(expected, abs=1e-8 * BACKLASH)
    closed, mean = (limit + until) / end, MASS * v * (1 - share**2) / end
    statistics = [
        found[f"contact/mesh/{name}"] for name in ("closed_share", "lower_share", "mean_force", "dynamic_factor")
    ]
    largest = found["contact/mesh/largest_force"]
    np.testing.assert_allclose(statistics, [2 * closed, closed, mean, largest / mean], rtol=1e-7)


@pytest.mark.parametrize("integrator", METHODS)
def test_acting_in_the_backlash_too(folder, integrator):
    """Within the backlash d' decays with b/m; on the flanks it is a damped oscillator, which may pull."""
    v, start_at, rate = 0.8, -8e-5, DAMPING / MASS
    touch = -np.log(1 + start_at * rate / v) / rate
    w = v * np.exp(-rate * touch)
    leaves = when(lambda x: -free(0.0, w, x)[0], 1e-4, 6e-3)
    out = free(0.0, w, leaves)[1]
    assert out < 0
    for at, expected in (
        (0.5 * touch, start_at + v / rate * (1 - np.exp(-0.5 * rate * touch))),
        (touch + 0.4 * leaves, free(0.0, w, 0.4 * leaves)[0]),
        (touch + leaves + 2e-5, out / rate * (1 - np.exp(-rate * 2e-5))),
    ):
        found = motion(folder, ", damping_acts='always'", integrator, t_end=at, start=start_at)
        assert last(found) == pytest.approx(expected, abs=1e-9 * BACKLASH), at
    assert smallest_force(found) < -0.5 * DAMPING * abs(out)


@pytest.mark.parametrize("keys", ["stiffness_cosine=0.3,0.1, mesh_phase=20.0", "contact_ratio=1.4"])
def test_always_is_a_damper_beside_the_mesh(folder, keys):
    """Also where the stiffness varies: dampers between each wheel and the frame give the same motion."""
    always = motion(folder, f", damping_acts='always', {keys}", "dop853", t_end=0.05)
    text = (folder / "wheels.nml").read_text()
    # Wheels that start against each other stay so: d = 2 r q, and b d'/r on each is 2 b r² q'.
    dampers = "".join(f"&damper between='{wheel}','frame', damping={2 * DAMPING * RADIUS**2!r} /\n" for wheel in "ab")
    opposed = "&initial on='a', velocity=4.0 /\n&initial on='b', velocity=-4.0 /\n"
    lines = [line for line in text.splitlines() if not line.startswith("&initial")]
    mesh = next(line for line in lines if line.startswith("&gear_mesh"))
    results = []
    for replaced, more in ((mesh, ""), (mesh.replace("damping=60.0", "damping=0.0"), dampers)):
        changed = "\n".join(replaced if line is mesh else line for line in lines) + "\n" + opposed + more
        (folder / "both.nml").write_text(changed)
        results.append(last(run("both.nml")))
    assert results[0] == pytest.approx(results[1], abs=1e-9 * BACKLASH)
    assert abs(last(always)) < 1e-3


@pytest.mark.parametrize("integrator", METHODS)
def test_teeth_do_not_pull_unless_told_so(folder, integrator):
    default, told = (motion(folder, keys, integrator) for keys in ("", ", separation='zero_force'"))
    pulls = motion(folder, ", separation='zero_deformation'", integrator)
    assert last(default) == last(told) != last(pulls)
    alone = [motion(folder, keys, integrator, t_end=5e-3) for keys in ("", ", separation='zero_deformation'")]
    assert smallest_force(alone[0]) == 0.0
    assert smallest_force(alone[1]) < -10.0


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ("separation='zero_force', damping_acts='limited'", "left out with damping_acts = 'limited'"),
        ("separation='zero_deformation', damping_acts='always'", "left out with damping_acts = 'always'"),
    ],
)
def test_refused(folder, keys, said):
    text = WHEELS.format(keys=", " + keys, integrator="exact", t_end=0.1, interval=0.1, start=0.0, speed=1.0)
    (folder / "wheels.nml").write_text(text)
    done = start("razy-run", "wheels.nml")
    assert done.returncode != 0 and f"&gear_mesh separation = {keys[11:].split(',')[0]}: {said}" in done.stderr
