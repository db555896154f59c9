"""Rotors from ROSS have its eigenvalues and unbalance responses; numbers by ross/make_reference.py."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from programs import SOURCE, succeed, values_of

sys.path.insert(0, str(SOURCE / "post" / "src"))
import razy
from razy.tools.ross import main

HERE = Path(__file__).parent / "ross"
REFERENCE = json.loads((HERE / "reference.json").read_text())
RPM = 30.0 / np.pi
# The cone is one of tapered elements in the file; the reference is what ever more cylinders tend to.
NAMES = ("rotor_example", "cone")
BOUND = {"cone": 2e-4}
JOINED = ("pedestal", "coupling", "coaxial", "proportional", "no_rotary_inertia", "axial_force", "torque")


def modes(case, text):
    Path("case.nml").write_text(case.read_text() + text)
    succeed("razy-modes", "case.nml", "--output", "modes.h5", "--force")
    return values_of("modes.h5")


def imported(folder, name):
    """Return the case without its speeds, which each test sets."""
    case = razy.import_ross(HERE / f"{name}.toml", folder / f"{name}.nml")
    groups = case.read_text().split("&")
    case.write_text("&".join(group for group in groups if not group.startswith(("campbell", "rotation", "modes"))))
    return case


@pytest.mark.parametrize("name", NAMES + JOINED)
def test_eigenvalues(folder, name):
    case = imported(folder, name)
    for speed, values in REFERENCE[name]["eigenvalues"].items():
        rpm = float(speed) * RPM
        found = modes(
            case,
            f"&rotation speed_rpm={rpm!r} /\n&modes count=40 /\n"
            f"&campbell first_rpm={rpm!r}, last_rpm={rpm * (1 + 1e-3) + 1e-3!r}, points=2, damped=.true. /\n",
        )["eigenvalue"][0]
        # Eight elements do not have twelve modes right.
        values = values[: 4 if name == "cone" else None]
        found = found[found[:, 1] > 1.0][: len(values)]
        size = np.hypot(*np.transpose(values))[:, None]
        np.testing.assert_allclose(found / size, values / size, rtol=0, atol=BOUND.get(name, 1e-8))


@pytest.mark.parametrize("name", NAMES)
def test_unbalance_response(folder, name):
    case, unbalance = imported(folder, name), REFERENCE[name]["unbalance"]
    node, seen = (1 + unbalance[key] for key in ("node", "seen"))
    angle = unbalance["phase"] * 180 / np.pi
    (first, low), (last, high) = REFERENCE[name]["response"].items()
    found = modes(
        case,
        f"&unbalance shaft='rotor', node={node}, moment={unbalance['moment']}, angle={angle!r} /\n"
        f"&record observable='displacement', of='rotor.{seen}.v', what='extrema' /\n"
        f"&record observable='displacement', of='rotor.{seen}.w', what='extrema' /\n"
        f"&rotation speed_rpm={float(first) * RPM!r} /\n&response parameter='rotation%speed_rpm', "
        f"first={float(first) * RPM!r}, last={float(last) * RPM!r}, points=3 /\n",
    )
    for end, expected in ((0, low), (-1, high)):
        phasors = [found[f"response/phasor/displacement.rotor.{seen}.{axis}"][end, 0] for axis in "vw"]
        size = np.hypot(*np.transpose(expected)).max()
        np.testing.assert_allclose(
            np.array(phasors) / size, np.array(expected) / size, rtol=0, atol=BOUND.get(name, 1e-8)
        )


def test_command(folder, capsys):
    assert main([str(HERE / "rotor_example.toml")]) == 0
    assert (folder / "rotor_example.nml").is_file()
    assert main([str(HERE / "rotor_example.toml")]) == 2
    assert "exists already" in capsys.readouterr().err
    data = (HERE / "rotor_example.toml").read_text()
    for old, new, says in (
        ("mxx = [ 0,]", "mxx = [ 1.0,]", "coefficients of mass"),
        ('"cowper"', '"hutchinson"', "only 'cowper' is taken"),
        ("ShaftElement_Shaft", "Beam_Shaft", "no ShaftElement"),
        ("[parameters]", "parameters]", "no .toml or .json file"),
    ):
        assert old in data
        Path("other.toml").write_text(data.replace(old, new))
        assert main(["other.toml", "--output", "other.nml"]) == 2
        said = capsys.readouterr().err
        assert says in said and said.count("\n") == 1, said


def test_point_masses_of_ross_1(folder):
    text = (HERE / "coaxial.toml").read_text()
    assert "\nmz = " in text
    Path("one.toml").write_text("\n".join(line for line in text.split("\n") if not line.startswith("mz = ")))
    new, old = (razy.import_ross(file, f"{file.stem}.nml") for file in (HERE / "coaxial.toml", Path("one.toml")))
    assert old.read_text().replace("one (", "coaxial (") == new.read_text()


def test_a_pedestal_without_mass_is_refused(folder):
    text = (HERE / "pedestal.toml").read_text()
    assert "n = 7\nmx" in text
    Path("light.toml").write_text(text.replace("n = 7\nmx", "n = 3\nmx"))
    with pytest.raises(razy.Error, match="node 7 has no mass; give it a PointMass"):
        razy.import_ross("light.toml", "light.nml")


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("n = 0\n", "", "an element has no 'n'"),
        ("m = 32", "m = 1" + "0" * 400 + "\nx = 32", "is beyond 1e.30"),
        ("m = 32", "m = 1e308\nx = 32", "is beyond 1e.30"),
        ("n = 1\n", 'n = "np.int64(1)"\n', "the number of a node is wanted; import each shaft"),
        ("odl = 0.05", "odl = 'x'", "a number that is not negative is wanted"),
        ("odl = 0.05", "odl = -0.05", "a number that is not negative is wanted"),
        ("odl = 0.05", "odl = true", "a number that is not negative is wanted"),
        ("odl = 0.05", "odl = [0.05]", "a number that is not negative is wanted"),
        ("kxx = [", "kxx = [true, ", "numbers are wanted"),
    ],
)
def test_what_rotor_save_does_not_write_is_one_line(folder, old, new, line):
    text = (HERE / "rotor_example.toml").read_text()
    assert old in text
    Path("odd.toml").write_text(text.replace(old, new, 1))
    with pytest.raises(razy.Error, match=line) as caught:
        razy.import_ross("odd.toml", "odd.nml")
    assert "\n" not in str(caught.value) and not Path("odd.nml").exists()
