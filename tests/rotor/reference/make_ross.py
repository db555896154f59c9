"""Natural frequencies of one shaft with a disk by ROSS (PyPI ross-rotordynamics), for tests/rotor/data/ross.txt.

The shaft is stepped and hollow in one section, the disk off its middle, the bearings are springs, isotropic at the left
and not at the right end. Run: python make_ross.py ../data/ross.txt, with ROSS 2.3.0 and plotly < 6; the tests only read
the numbers.

Lines: `case shear speed` (shear 0 or 1; rad/s), then one circular frequency of the undamped system, rad/s, a line,
ascending.
"""

import sys
from pathlib import Path

import numpy as np
import ross
from scipy.linalg import eigvals

SECTIONS = [(0.2, 0.05, 0.0, 4), (0.5, 0.06, 0.02, 10), (0.15, 0.04, 0.0, 3)]
DISK_NODE, DISK = 9, {"m": 12.0, "Id": 0.05, "Ip": 0.09}
FREQUENCIES = 24


def rotor(shear: bool) -> ross.Rotor:
    """The rotor, with ROSS's Timoshenko element (Cowper) or without shear."""
    steel = ross.Material(name="steel", rho=7850.0, E=2.1e11, G_s=8.0e10)
    elements = []
    for length, outer, inner, count in SECTIONS:
        elements += [
            ross.ShaftElement(
                L=length / count,
                idl=inner,
                odl=outer,
                material=steel,
                shear_effects=shear,
                rotary_inertia=True,
                gyroscopic=True,
                shear_method_calc="cowper",
            )
            for _ in range(count)
        ]
    disk = ross.DiskElement(n=DISK_NODE, **DISK)
    left = ross.BearingElement(n=0, kxx=3.0e7, kyy=3.0e7, kzz=2.0e7, cxx=0.0, cyy=0.0)
    right = ross.BearingElement(n=len(elements), kxx=2.0e7, kyy=5.0e7, kzz=0.0, cxx=0.0, cyy=0.0)
    return ross.Rotor(elements, [disk], [left, right])


def frequencies(system: ross.Rotor, speed: float) -> np.ndarray:
    """Positive imaginary parts of the eigenvalues of ROSS's own matrices; its eigensolver is not what is compared."""
    mass, gyroscopic, stiffness = system.M(0.0), system.G(), system.K(0.0)
    size = mass.shape[0]
    # Generalised form and scaling by frequencies: inverting M would cost digits.
    scale = 1.0e4
    a = np.block([[np.zeros((size, size)), np.eye(size)], [-stiffness / scale**2, -speed * gyroscopic / scale]])
    b = np.block([[np.eye(size), np.zeros((size, size))], [np.zeros((size, size)), mass]])
    imaginary = np.sort(eigvals(a, b).imag) * scale
    return imaginary[imaginary > 1.0][:FREQUENCIES]


def main() -> None:
    """Write all cases into the file named."""
    lines = []
    for shear in (False, True):
        system = rotor(shear)
        for speed in (0.0, 1500.0):
            lines.append(f"case {int(shear)} {speed}")
            lines += [f"{value:.15e}" for value in frequencies(system, speed)]
    Path(sys.argv[1]).write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
