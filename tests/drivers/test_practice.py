"""What docs/rotor.md says under questions of practice, with the lines that it prints."""

import re

import numpy as np
from programs import SOURCE, succeed, values_of
from scipy.integrate import solve_ivp

# The rotor of Jeffcott: a shaft without mass between rigid supports.
ROTOR = """&scene kind='rotor' /
&shaft name='r', young_modulus=2.1e11, poisson_ratio=0.3, density=0.0 /
&section shaft='r', length=1.0, outer_diameter=0.04, elements=2 /
&disk shaft='r', node=2, mass=20.0, polar_inertia=0.3, diametral_inertia=0.15 /
&support shaft='r', node=1, held='u','v','w','phi' /
&support shaft='r', node=3, held='v','w' /
&bearing shaft='r', node=2, kind='matrix', stiffness=0.0,0.0,0.0,0.0, damping_matrix=40.0,0.0,0.0,40.0 /
&rotation speed_rpm=2500.0 /
"""
MASS, DAMPING, STIFFNESS = 20.0, 40.0, 48 * 2.1e11 * np.pi * 0.04**4 / 64
PAGE = (SOURCE / "docs" / "rotor.md").read_text().split("## Questions of practice")[1]
BOW, TWO = re.findall(r"```\n(.*?)```", PAGE, flags=re.DOTALL)


def test_bow_and_unbalance(folder):
    records = "".join(f"&record observable='displacement', of='r.2.{of}', what='extrema' /\n" for of in "vw")
    over = "&response parameter='rotation%speed_rpm', first=100.0, last=4000.0, points=40 /\n"
    (folder / "bow.nml").write_text(ROTOR + BOW + records + over)
    succeed("razy-modes", "bow.nml")
    found = values_of("bow.h5")
    speed = found["response/parameter"] * np.pi / 30
    bow, unbalance = 30.0 * np.exp(1j * np.radians(210)), 1.0e-3 * np.exp(1j * np.radians(30))
    # v + i w = x exp(i speed t), so that v and w have the phasors x and -i x.
    x = (bow + unbalance * speed**2) / (STIFFNESS - MASS * speed**2 + 1j * DAMPING * speed)
    for of, factor in (("v", 1.0), ("w", -1j)):
        value = found[f"response/phasor/displacement.r.2.{of}"][:, 0] @ [1, 1j]
        np.testing.assert_allclose(value, factor * x, rtol=1e-9)


def test_a_shaft_of_two_stiffnesses(folder):
    """At 2500 rpm, between both critical speeds, it is unstable; at 1500 rpm it is not."""
    records = "".join(
        f"&record observable='displacement', of='r.2.{of}', what='trajectory', interval=1e-3 /\n" for of in "vw"
    )
    more = "&gravity direction=0.0,-1.0,0.0 /\n&motion t_end=0.8, start='zero' /\n"
    largest = []
    for rpm in (1500.0, 2500.0):
        (folder / "two.nml").write_text(ROTOR.replace("2500.0", repr(rpm)) + TWO + more + records)
        succeed("razy-run", "two.nml", "--force")
        found = values_of("two.h5")
        omega = rpm * np.pi / 30

        def rate(t, y, omega=omega):
            along = np.array([np.cos(omega * t), np.sin(omega * t)])
            force = -STIFFNESS * y[:2] - DAMPING * y[2:] - 2.0e5 * along * (along @ y[:2])
            return np.concatenate([y[2:], force / MASS + [-9.81, 0.0]])

        other = solve_ivp(rate, (0.0, 0.8), np.zeros(4), "DOP853", found["time"], rtol=1e-11, atol=1e-14).y
        for of, expected in zip("vw", other, strict=False):
            value = found[f"observable/displacement.r.2.{of}"]
            np.testing.assert_allclose(value, expected, rtol=0, atol=1e-6 * np.abs(expected).max())
        largest.append(np.abs(other[0][found["time"] > 0.7]).max())
    assert largest[1] > 50 * largest[0]
