"""`observable='connection_force'`: springs, dampers and bearings, from the motions of their ends."""

import re

import h5py
import numpy as np
import pytest
from programs import start, succeed

LUMPED = """
&scene kind='lumped' /
&mass name='a', value=1.0 /
&mass name='b', value=2.0 /
&spring name='coil', between='a','b', stiffness=100.0, damping=0.5, damping_factor=0.01 /
&spring between='b','frame', stiffness=50.0 /
&damper name='dashpot', between='b','frame', damping=3.0 /
&spring name='hard', between='a','frame', law='table', displacement=-1.0,1.0, force=-5.0,5.0 /
&load on='a', value=1.0, amplitude=2.0, frequency=1.3 /
&motion t_end=2.0 /
&record observable='state', what='trajectory', interval=0.01 /
"""
PLANAR = """
&scene kind='planar' /
&body name='table', mass=3.0, inertia=0.2 /
&point name='left', body='table', position=-0.5,0.0 /
&point name='right', body='table', position=0.5,0.0 /
&spring name='feet', between='left','frame','right','frame', direction=0,1, stiffness=400.0, damping=2.0 /
&damping factor=0.01, matrix='springs' /
&load on='right.y', amplitude=5.0, frequency=2.0 /
&motion t_end=2.0 /
&record observable='state', what='trajectory', interval=0.01 /
"""
ROTOR = """
&scene kind='rotor' /
&shaft name='rotor', young_modulus=2.1e11, shear_modulus=8.0e10, density=7850.0 /
&section shaft='rotor', length=0.6, outer_diameter=0.03, elements=4 /
&housing name='casing', mass=30.0 /
&bearing shaft='casing', node=1, kind='matrix', stiffness=1e6,0,0,1e6, damping_matrix=1e2,0,0,1e2 /
&bearing name='front', shaft='rotor', node=1, to='casing', kind='matrix', stiffness=2e7,4e6,-4e6,1e7,
         damping_matrix=4e3,50,-50,3e3 /
&bearing name='rear', shaft='rotor', node=5, kind='matrix', stiffness=2e7,0,0,1e7, damping_matrix=4e3,0,0,4e3 /
&support shaft='rotor', node=1, held='u','phi' /
&support shaft='casing', node=1, held='u','phi','theta','psi' /
&unbalance shaft='rotor', node=3, moment=1e-4 /
&rotation speed_rpm=3000.0 /
&motion t_end=0.05 /
&modes count=3 /
&response parameter='rotation%speed_rpm', first=1000.0, last=3000.0, points=3 /
"""


def record(of, what="trajectory"):
    return f"&record observable='connection_force', of='{of}', what='{what}', interval=0.01 /\n"


def state_of(file):
    names = [name.decode() for name in file["state/coordinate"][()]]
    motion = zip(file["state/displacement"][()].T, file["state/velocity"][()].T, strict=True)
    return dict(zip(names, motion, strict=True))


def test_springs_and_dampers(tmp_path):
    path = tmp_path / "lumped.nml"
    path.write_text(LUMPED + record("coil") + record("dashpot"))
    succeed("razy-run", path, "--force")
    with h5py.File("lumped.h5") as file:
        (a, va), (b, vb) = state_of(file).values()
        coil, dashpot = (file[f"observable/connection_force.{name}"] for name in ("coil", "dashpot"))
        assert coil.attrs["units"] == b"N" or coil.attrs["units"] == "N"
        assert coil[()] == pytest.approx(100 * (a - b) + 1.5 * (va - vb), rel=1e-12, abs=1e-12)
        assert dashpot[()] == pytest.approx(3 * vb, rel=1e-12, abs=1e-12)


def test_all_pairs_of_a_planar_spring_with_proportional_damping(tmp_path):
    path = tmp_path / "planar.nml"
    path.write_text(PLANAR + record("feet"))
    succeed("razy-run", path, "--force")
    with h5py.File("planar.h5") as file:
        y, v = state_of(file)["table.y"]
        assert file["observable/connection_force.feet"][()] == pytest.approx(400 * y + 6 * v, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("reduction", ["", "&reduction method='modal_synthesis', modes=8,2 /\n"])
def test_bearings(tmp_path, reduction):
    """In motion and in the response; with cross-coupling, into a housing, reduced or not."""
    names = [f"{place}.{axis}" for place in ("rotor.1", "casing.1") for axis in "vw"]
    places = "".join(
        f"&record observable='{kind}', of='{name}', what='trajectory', interval=0.001 /\n"
        for name in names
        for kind in ("displacement", "velocity")
    )
    forces = "".join(record(f"front.{axis}").replace("0.01", "0.001") for axis in "vw")
    path = tmp_path / "rotor.nml"
    path.write_text(ROTOR + reduction + places + forces)
    stiffness, damping = np.array([[2e7, 4e6], [-4e6, 1e7]]), np.array([[4e3, 50], [-50, 3e3]])
    succeed("razy-run", path, "--force")
    with h5py.File("rotor.h5") as file:
        found = {name: file["observable"][name][()] for name in file["observable"]}
    q, v = (
        np.array([found[f"{kind}.rotor.1.{axis}"] - found[f"{kind}.casing.1.{axis}"] for axis in "vw"])
        for kind in ("displacement", "velocity")
    )
    force = np.array([found[f"connection_force.front.{axis}"] for axis in "vw"])
    assert abs(force).max() > 1.0
    assert force == pytest.approx(stiffness @ q + damping @ v, rel=1e-9, abs=1e-9 * abs(force).max())
    succeed("razy-modes", path, "--output", "modes.h5", "--force")
    with h5py.File("modes.h5") as file:
        omega = 2 * np.pi * file["response/frequency"][:, 0]
        found = {name: file["response/phasor"][name][:, 0, :] @ [1, 1j] for name in file["response/phasor"]}
    q = np.array([found[f"displacement.rotor.1.{axis}"] - found[f"displacement.casing.1.{axis}"] for axis in "vw"])
    force = np.array([found[f"connection_force.front.{axis}"] for axis in "vw"])
    assert force == pytest.approx(stiffness @ q + damping @ (1j * omega * q), rel=1e-9)


@pytest.mark.parametrize(
    ("text", "of", "said"),
    [
        (LUMPED, "coal", "of = 'coal': the name of a spring; "),
        (re.sub("name='(coil|dashpot|hard)',", "", LUMPED), "coil", "there are no connections with names"),
        (LUMPED, "hard", "observable = 'connection_force': 'contact_force' of a spring that is not linear"),
        (ROTOR, "front", "of = 'front': a spring or damper, or a bearing and one of u, v, w, phi, theta, psi"),
        (ROTOR, "middle.v", "of = 'middle.v': the name of a bearing; "),
    ],
)
def test_refusals(tmp_path, text, of, said):
    (tmp_path / "bad.nml").write_text(text + record(of))
    done = start("razy-run", tmp_path / "bad.nml")
    assert done.returncode == 2
    assert said in done.stderr
    assert done.stderr.count("\n") == 1
