"""One shaft of the test gearbox in ROSS: time of a Campbell diagram a speed, and of a time response.

    ROSS_PYTHON bench/peers/ross_shaft.py SPEEDS END STEP

ROSS 2.3.0 (PyPI ross-rotordynamics) with plotly < 6. Standard output: `key value` lines, processor times in s, and the
largest displacement at the disk in the second half of the time response.
"""

import sys
import time

import numpy as np
import ross

SECTIONS = [(0.06, 0.03, 2), (0.26, 0.04, 10), (0.06, 0.03, 2)]
NODE, SPEED, UNBALANCE = 7, 300.0, 1.0e-4


def rotor():
    """Shaft, wheel and bearings of `inputs/test_gearbox.nml`; twist is free, bearings are damped."""
    steel = ross.Material(name="steel", rho=7850.0, E=2.1e11, G_s=8.0e10)
    elements = [
        ross.ShaftElement(
            L=length / count, idl=0.0, odl=outer, material=steel, shear_effects=False, rotary_inertia=True
        )
        for length, outer, count in SECTIONS
        for _ in range(count)
    ]
    disk = ross.DiskElement(n=NODE, m=2.3675, Id=4.0753e-3, Ip=8.0495e-3)
    left = ross.BearingElement(n=2, kxx=1.75e8, kyy=1.75e8, kzz=3.0e7, cxx=2.0e3, cyy=2.0e3)
    right = ross.BearingElement(n=12, kxx=7.0e8, kyy=7.0e8, cxx=2.0e3, cyy=2.0e3)
    return ross.Rotor(elements, [disk], [left, right])


def main():
    speeds, end, step = int(sys.argv[1]), float(sys.argv[2]), float(sys.argv[3])
    system = rotor()
    system.run_modal(100.0)
    begin = time.process_time()
    system.run_campbell(np.linspace(0.0, 6000.0, speeds))
    print("campbell", (time.process_time() - begin) / speeds)
    instants = step * np.arange(round(end / step) + 1)
    force = np.zeros((len(instants), system.ndof))
    force[:, 6 * NODE] = UNBALANCE * SPEED**2 * np.cos(SPEED * instants)
    force[:, 6 * NODE + 1] = UNBALANCE * SPEED**2 * np.sin(SPEED * instants)
    begin = time.process_time()
    response = system.run_time_response(SPEED, force, instants, method="newmark")
    print("response", time.process_time() - begin)
    print("displacement", np.abs(response.yout[len(instants) // 2 :, 6 * NODE]).max())
    print("coordinates", system.ndof)


if __name__ == "__main__":
    main()
