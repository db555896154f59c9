"""The response of `&response` beside long motions, of what is free, and what is refused."""

import h5py
import numpy as np
import pytest
from programs import SOURCE, sets, start, succeed

ROTOR = """
&scene     kind='rotor', title='A disc on a shaft' /
&shaft     name='rotor', young_modulus=2.1e11, shear_modulus=8.0e10, density=7850.0 /
&section   shaft='rotor', length=0.6, outer_diameter=0.03, elements=6 /
&disk      shaft='rotor', node=3, mass=8.0, polar_inertia=0.06, diametral_inertia=0.035 /
&bearing   shaft='rotor', node=1, kind='matrix', stiffness=2.0e7,3.0e5,-2.0e5,1.0e7,
           damping_matrix=4.0e3,0.0,0.0,4.0e3 /
&bearing   shaft='rotor', node=7, kind='matrix', stiffness=2.0e7,0.0,0.0,1.0e7,
           damping_matrix=4.0e3,0.0,0.0,4.0e3 /
&support   shaft='rotor', node=1, held='u','phi' /
&unbalance shaft='rotor', node=3, moment=1.0e-4 /
&rotation  speed_rpm=3000.0 /
&motion    t_end=15.0, start='zero' /
&record    observable='displacement', of='rotor.3.v', what='extrema', from=14.9 /
&record    observable='displacement', of='rotor.3.w', what='extrema', from=14.9 /
&response  parameter='rotation%speed_rpm', first=3000.0, last=6000.0, points=4 /
"""


def test_response_is_what_long_motions_end_in(folder):
    """Unbalance with gyroscopic and skew matrices; tooth errors of a gear pair that stays closed."""
    case = folder / "rotor.nml"
    case.write_text(ROTOR)
    gears = folder / "gears.nml"
    gears.write_text(
        (SOURCE / "inputs" / "torsional_gear_pair.nml").read_text()
        + "&response parameter='rotation%speed_rpm', first=700.0, last=1000.0, points=4 /\n"
    )
    long = sets(motion__t_end=2.0, record__from=1.95)
    for file, options, names, speeds in (
        (case, [], ["displacement.rotor.3.v", "displacement.rotor.3.w"], {0: 3000.0, 2: 5000.0}),
        (gears, long, ["mesh_deformation"], {0: 700.0, 1: 800.0}),
    ):
        succeed("razy-modes", file, *options, "--output", "modes.h5", "--force")
        for point, speed in speeds.items():
            succeed("razy-run", file, *options, *sets(rotation__speed_rpm=speed), "--output", "run.h5", "--force")
            with h5py.File("modes.h5") as found, h5py.File("run.h5") as run:
                assert found["response/parameter"][point] == speed
                for name in names:
                    extrema = run[f"extrema/{name}/value"][()]
                    (phasor,) = found[f"response/phasor/{name}"][point]
                    assert np.hypot(*phasor) == pytest.approx(0.5 * np.ptp(extrema), rel=1e-9)


@pytest.mark.parametrize("slow", [1e-6, 1e-3, 1.0])
def test_response_of_a_free_train(folder, slow):
    """Slow loads move a train that nothing holds as a whole; rounding of its springs is no spring to the frame."""
    draw = np.random.default_rng(1)
    mass, stiffness = draw.uniform(0.5, 2.0, 12), 10.0 ** draw.uniform(6, 10, 11)
    lines = [f"&mass name='b{i}', value={float(m)} /" for i, m in enumerate(mass)]
    lines += [
        f"&spring between='b{i}','b{i + 1}', stiffness={float(k)}, damping={float(d * k)} /"
        for i, (k, d) in enumerate(zip(stiffness, draw.choice([0.0, 1e-4], 11), strict=True))
    ]
    lines += ["&load on='b0', amplitude=1.0, angular_frequency=1.0, phase=90.0 /"]
    lines += ["&stop name='s', between='b10','b11', clearance=0.0, stiffness=1e9 /"]
    lines += ["&record observable='displacement', of='b11', what='extrema' /"]
    lines += ["&record observable='contact_force', of='s', what='extrema' /"]
    lines += [f"&response parameter='load%angular_frequency', first={slow}, last={2 * slow}, points=3 /"]
    case = folder / "train.nml"
    case.write_text("\n".join(lines))
    succeed("razy-modes", case, "--output", "train.h5")
    with h5py.File("train.h5") as found:
        moved, force = (found[f"response/phasor/{name}"][0, 0] for name in ("displacement.b11", "contact_force.s"))
    # The whole train moves as one, but for less than 1e-5 of it at 1 rad/s.
    assert moved[0] == pytest.approx(-1 / (mass.sum() * slow**2), rel=1e-12 + 1e-5 * slow**2)
    # The stop and the spring beside it accelerate the last mass.
    share = 1e9 / (1e9 + stiffness[-1])
    assert abs(force[0]) == pytest.approx(share * mass[-1] / mass.sum(), rel=1e-9 + 1e-3 * slow**2)


def test_response_is_refused_in_one_line(folder):
    case = folder / "rotor.nml"
    case.write_text(ROTOR.replace("rotation%speed_rpm', first", "rotation%sped', first"))
    done = start("razy-modes", case)
    assert done.returncode == 2
    assert "&response parameter = 'rotation%sped': " in done.stderr
    assert done.stderr.count("\n") == 1
    stop = folder / "stop.nml"
    stop.write_text(
        (SOURCE / "inputs" / "impact_oscillator.nml").read_text()
        + "&response parameter='load%angular_frequency', first=1.0, last=2.0 /\n"
    )
    done = start("razy-modes", stop)
    assert done.returncode == 2 and "'open': the contact wall is rigid" in done.stderr
    assert start("razy-modes", stop, *sets(modes__contacts="'open'")).returncode == 0


@pytest.mark.parametrize("damping", [60.0, 30.0])
def test_no_margin_is_asked_of_a_flat_peak(folder, damping):
    """API 617, 2.6.2: nothing below an amplification factor of 2.5, else 17 % (1 - 1/(AF - 1.5)) below the range."""
    (folder / "case.nml").write_text(
        f"&inertia name='i', value=1.0 /\n&spring between='i','frame', stiffness=1.0e4, damping={damping} /\n"
        "&rotation speed_rpm=600.0, of='i' /\n&load on='i', amplitude=1.0, order=1.0 /\n"
        "&record observable='displacement', what='extrema' /\n"
        "&response parameter='rotation%speed_rpm', first=100.0, last=2000.0, points=200, operating=1200.0,1500.0 /\n"
    )
    succeed("razy-modes", "case.nml")
    with h5py.File("case.h5") as file:
        factor, margin = file["response/amplification_factor"][0], file["response/required_margin"][0]
    assert (factor < 2.5) == (damping > 50.0)
    assert margin == pytest.approx(0.0 if factor < 2.5 else 0.17 * (1 - 1 / (factor - 1.5)), rel=1e-12)
