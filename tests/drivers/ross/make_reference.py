"""Eigenvalues and unbalance responses of rotors by ROSS (PyPI ross-rotordynamics), for test_ross.py.

Run: python make_reference.py, with ROSS 2.3.0 and plotly < 6; it writes reference.json and rotors as ROSS saves them.

The matrices are ROSS's; its eigensolver is not what is compared.
"""

import json
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import ross
from scipy.linalg import eigvals

HERE = Path(__file__).resolve().parent


def eigenvalues(rotor: ross.Rotor, speed: float, count: int) -> list[list[float]]:
    """Return the lowest damped eigenvalues, in the order of their imaginary parts."""
    mass, damping, stiffness = rotor.M(speed), rotor.C(speed) + speed * rotor.G(), rotor.K(speed)
    size, scale = len(mass), 1.0e3
    a = np.block([[np.zeros((size, size)), np.eye(size)], [-stiffness / scale**2, -damping / scale]])
    b = np.block([[np.eye(size), np.zeros((size, size))], [np.zeros((size, size)), mass]])
    values = eigvals(a, b) * scale
    values = values[values.imag > 1.0]
    return [[value.real, value.imag] for value in values[np.argsort(values.imag)][:count]]


def response(rotor: ross.Rotor, node: int, moment: float, phase: float, seen: int, speed: float) -> list[list[float]]:
    """Return the phasors of x and y of a node under an unbalance."""
    force = rotor._unbalance_force(node, moment, phase, [speed])[:, 0]
    matrix = rotor.K(speed) - speed**2 * rotor.M(speed) + 1j * speed * (rotor.C(speed) + speed * rotor.G())
    # What nothing holds, axial motion and twist, is not moved by an unbalance.
    lateral = [i for i in range(rotor.ndof) if i % 6 in (0, 1, 3, 4)]
    moved = np.zeros(rotor.ndof, dtype=complex)
    moved[lateral] = np.linalg.solve(matrix[np.ix_(lateral, lateral)], force[lateral])
    return [[moved[6 * seen + i].real, moved[6 * seen + i].imag] for i in range(2)]


def cone(elements: int, tapered: bool) -> ross.Rotor:
    """Return a rotor with a conical hollow shaft and a disk, on bearings with cross coupling.

    Eight tapered elements of ROSS err by up to 2e-2 of an eigenvalue. Cylinders with the diameters in their middles err
    by the square of their length, so `limit` is right to 1e-6.
    """
    steel = ross.Material(name="steel", rho=7850.0, E=2.1e11, G_s=8.0e10)
    shaft = []
    for i in range(elements):
        left, right = (i / elements, (i + 1) / elements) if tapered else 2 * ((i + 0.5) / elements,)
        ends = {"idl": 0.01 + 0.02 * left, "odl": 0.05 + 0.04 * left}
        ends |= {"idr": 0.01 + 0.02 * right, "odr": 0.05 + 0.04 * right}
        shaft.append(ross.ShaftElement(L=0.8 / elements, material=steel, **ends))
    disk = ross.DiskElement(n=5 * elements // 8, m=15.0, Id=0.06, Ip=0.1)
    oil = {"kxx": 2.0e7, "kxy": 5.0e6, "kyx": -8.0e6, "kyy": 3.0e7, "cxx": 2.0e4, "cyy": 3.0e4}
    bearings = [ross.BearingElement(n=0, **oil), ross.BearingElement(n=elements, kzz=1.0e7, **oil)]
    return ross.Rotor(shaft, [disk], bearings)


def limit(find: Callable[[int], list[list[float]]]) -> list[list[float]]:
    """Return what numbers that depend on the elements of a cone tend to."""
    coarse, fine = np.array(find(80)), np.array(find(160))
    return ((4 * fine - coarse) / 3).tolist()


def joined() -> dict[str, ross.Rotor]:
    """Return rotors of more than a shaft on the frame, and with damping of all they are made of."""
    steel = ross.Material(name="steel", rho=7810, E=211e9, G_s=81.2e9)

    def shaft(count: int = 6, **more) -> list[ross.ShaftElement]:
        return [ross.ShaftElement(L=0.25, idl=0.0, odl=0.05, material=steel, **more) for _ in range(count)]

    disk = ross.DiskElement.from_geometry(2, steel, 0.07, 0.05, 0.28)
    held = {"kxx": 1.0e6, "kyy": 8.0e5, "cxx": 3.0e3}
    ends = [ross.BearingElement(0, **held), ross.BearingElement(6, **held)]
    pedestal = [
        ross.BearingElement(0, n_link=7, kxx=1.0e6, kyy=8.0e5, cxx=1.0e3),
        ends[1],
        ross.BearingElement(7, kxx=1.0e7, kyy=1.0e7, cxx=500.0),
    ]
    coupling = ross.CouplingElement(
        m_l=5, m_r=4, Ip_l=0.02, Ip_r=0.03, Id_l=0.01, Id_r=0.02,
        kt_x=1.0e6, kt_y=2.0e6, kt_z=1.0e7, kr_x=1.0e5, kr_y=1.5e5, kr_z=5.0e4,
    )  # fmt: skip
    return {
        "pedestal": ross.Rotor(shaft(), [disk], pedestal, [ross.PointMass(n=7, mx=10.0, my=10.0, mz=10.0)]),
        "coupling": ross.Rotor(
            [*shaft(3), coupling, *shaft(2)], [disk], [ross.BearingElement(n, **held) for n in (0, 3, 4, 6)]
        ),
        "coaxial": ross.rotor_assembly.coaxrotor_example(),
        "proportional": ross.Rotor(shaft(alpha=2.0, beta=1.0e-5), [disk], ends),
        "no_rotary_inertia": ross.Rotor(shaft(rotary_inertia=False), [disk], ends),
        "axial_force": ross.Rotor(shaft(axial_force=2.0e5), [disk], ends),
        "torque": ross.Rotor(shaft(torque=1.0e4, shear_effects=False), [disk], ends),
    }


def main() -> None:
    """Write all."""
    warnings.simplefilter("ignore")
    cases = {
        "rotor_example": (
            ross.rotor_assembly.rotor_example(),
            [0.0, 200.0, 900.0],
            (2, 3.0e-4, 0.5, 3),
            [150.0, 310.0],
        ),
    }
    found = {"ross": ross.__version__}
    for name, (rotor, speeds, unbalance, driven) in cases.items():
        (HERE / f"{name}.toml").unlink(missing_ok=True)
        rotor.save(HERE / f"{name}.toml")
        node, moment, phase, seen = unbalance
        found[name] = {
            "eigenvalues": {repr(speed): eigenvalues(rotor, speed, 12) for speed in speeds},
            "unbalance": {"node": node, "moment": moment, "phase": phase, "seen": seen},
            "response": {repr(speed): response(rotor, *unbalance, speed) for speed in driven},
        }
    (HERE / "cone.toml").unlink(missing_ok=True)
    cone(8, True).save(HERE / "cone.toml")
    found["cone"] = {
        "eigenvalues": {
            repr(speed): limit(lambda n, speed=speed: eigenvalues(cone(n, False), speed, 12)) for speed in (0.0, 800.0)
        },
        "unbalance": {"node": 5, "moment": 1.0e-4, "phase": 0.3, "seen": 4},
        "response": {
            repr(speed): limit(lambda n, speed=speed: response(cone(n, False), 5 * n // 8, 1.0e-4, 0.3, n // 2, speed))
            for speed in (250.0, 700.0)
        },
    }
    for name, rotor in joined().items():
        (HERE / f"{name}.toml").unlink(missing_ok=True)
        rotor.save(HERE / f"{name}.toml")
        found[name] = {"eigenvalues": {repr(speed): eigenvalues(rotor, speed, 12) for speed in (100.0, 400.0)}}
    (HERE / "reference.json").write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
