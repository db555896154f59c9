"""`axial_force` of `&section`: frequencies, deflection and buckling of a pinned shaft against closed forms."""

import numpy as np
import pytest
from programs import start, succeed, values_of

E, G, RHO, LENGTH, DIAMETER = 2.1e11, 8.0e10, 7850.0, 0.8, 0.03
AREA, SECOND = np.pi * DIAMETER**2 / 4, np.pi * DIAMETER**4 / 64
EULER = np.pi**2 * E * SECOND / LENGTH**2


def shaft(force, elements=40, element="rayleigh", more=""):
    return f"""&scene kind='rotor' /
&shaft name='r', young_modulus={E}, shear_modulus={G}, density={RHO}, element='{element}', rotary_inertia=.false. /
&section shaft='r', length={LENGTH}, outer_diameter={DIAMETER}, elements={elements}, axial_force={float(force)!r} /
&freedom axial=.false., torsion=.false. /
&support shaft='r', node=1, held='v','w' /
&support shaft='r', node={elements + 1}, held='v','w' /
{more}"""


def modes(text, **options):
    with open("case.nml", "w") as file:
        file.write(text + "&modes count=6 /\n")
    succeed("razy-modes", "case.nml", "--force")
    return values_of("case.h5")


@pytest.mark.parametrize("elements", [40, 200])
@pytest.mark.parametrize("share", [-0.5, 2.0])
def test_frequencies_of_a_string_that_bends(folder, share, elements):
    """omega² = k² (E J k² + N)/(rho A), k = n pi/L; also with so many elements that modes are corrected."""
    k = np.pi / LENGTH * np.array([1, 1, 2, 2, 3, 3])
    right = np.sqrt(k**2 * (E * SECOND * k**2 + share * EULER) / (RHO * AREA)) / (2 * np.pi)
    found = modes(shaft(share * EULER, elements))
    assert found["natural_frequency"] == pytest.approx(right, rel=5e-6 if elements == 40 else 1e-8)
    text = shaft(share * EULER, more="&reduction method='craig_bampton', modes=20 /\n")
    assert modes(text)["natural_frequency"] == pytest.approx(right, rel=5e-6)


def test_it_buckles_at_the_load_of_euler_and_engesser(folder):
    kappa = 6 * (1 + (nu := E / (2 * G) - 1)) / (7 + 6 * nu)
    engesser = EULER / (1 + EULER / (kappa * G * AREA))
    for element, load in (("rayleigh", EULER), ("timoshenko", engesser)):
        assert modes(shaft(-load * (1 - 1e-4), element=element))["natural_frequency"][0] > 0
        (folder / "buckles.nml").write_text(shaft(-load * (1 + 1e-4), element=element) + "&modes count=6 /\n")
        done = start("razy-modes", "buckles.nml")
        assert done.returncode == 2
        assert "&section axial_force = " in done.stderr
        assert "less compression: the shaft buckles" in done.stderr
    assert engesser < EULER * (1 - 1e-3)


def test_deflection_under_tension(folder):
    """P/(2 N κ) (κ L/2 - tanh(κ L/2)) in the middle, κ² = N/(E J)."""
    force, load = 5 * EULER, 100.0
    kappa = np.sqrt(force / (E * SECOND))
    right = load / (2 * force * kappa) * (kappa * LENGTH / 2 - np.tanh(kappa * LENGTH / 2))
    more = f"&load on='r.21.v', value={load} /\n&motion t_end=1e-4, start='static' /\n"
    more += "&record observable='displacement', of='r.21.v', what='extrema' /\n"
    (folder / "rest.nml").write_text(shaft(force, more=more))
    succeed("razy-run", "rest.nml")
    assert values_of("rest.h5")["extrema/displacement.r.21.v/value"] == pytest.approx(right, rel=1e-6)


def test_a_free_shaft_under_tension_does_not_tilt_freely(folder):
    """The force keeps its direction: it rights a shaft that tilts, and moves with one that does not."""
    text = "".join(line for line in shaft(1e4).splitlines(True) if not line.startswith("&support"))
    found = modes(text)
    assert list(found["rigid"]) == [1, 1, 0, 0, 0, 0]
    assert found["natural_frequency"][2] > 1.0


def test_a_cone_that_carries_torque(folder):
    """Deflect by 64 F L³/(3 pi E D³ d), clamped at the thick end; a cylinder under torque aside by T F L⁴/(8 (E J)²).

    E J z'' - iT z' is the moment F (L - x) + c, c = 0 where the axis is fixed; where not, z'' = 0 at the tip: then -.
    """
    load, torque = 100.0, 1e-4 * E * SECOND / LENGTH
    tail = f"&load on='r.3.v', value={load} /\n&motion t_end=2.0 /\n"
    tail += "".join(
        f"&record observable='displacement', of='r.3.{axis}', what='trajectory', interval=1.0 /\n" for axis in "vw"
    )
    cases = ((2 * DIAMETER, 0.0, "shaft", "rayleigh", 0),) + tuple(
        (DIAMETER, torque, axis, element, sign)
        for axis, sign in (("shaft", -1), ("fixed", 1))
        for element in ("rayleigh", "timoshenko")
    )
    for outer, torque_given, axis, element, sign in cases:
        text = shaft(0.0, 2, element, more=tail).replace(f"outer_diameter={DIAMETER}", f"outer_diameter={outer!r}")
        text = text.replace(
            "elements=2", f"elements=2, outer_diameter_end={DIAMETER}, torque={torque_given!r}, torque_axis='{axis}'"
        )
        text = text.replace("rotary_inertia", "mass_damping=2000.0, rotary_inertia")
        head, _, rest = text.partition("&support")
        held = rest.partition("&load")[2]
        (folder / "tip.nml").write_text(head + "&support shaft='r', node=1, held='v','w','theta','psi' /\n&load" + held)
        succeed("razy-run", "tip.nml", "--force")
        found = [values_of("tip.h5")[f"observable/displacement.r.3.{axis}"][-1] for axis in "vw"]
        if torque_given:
            assert found[1] == pytest.approx(sign * torque * load * LENGTH**4 / (8 * (E * SECOND) ** 2), rel=1e-6)
        else:
            right = 64 * load * LENGTH**3 / (3 * np.pi * E * (2 * DIAMETER) ** 3 * DIAMETER)
            assert found == pytest.approx([right, 0.0], rel=1e-8, abs=1e-15)
    (folder / "bad.nml").write_text(text.replace(f"outer_diameter_end={DIAMETER}", "inner_diameter_end=0.04"))
    done = start("razy-run", "bad.nml")
    assert done.returncode == 2
    assert "&section inner_diameter_end = 0.04: less than the outer diameter, at both ends" in done.stderr
