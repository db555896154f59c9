"""Cases of razy-follow, and what their files hold."""

from pathlib import Path

import h5py
import numpy as np
from programs import SOURCE, sets, succeed

NORMAL_FORM = SOURCE / "inputs" / "gear_normal_form.nml"
PAIR_MAP = SOURCE / "inputs" / "gear_pair_map.nml"
IMPACT = SOURCE / "inputs" / "impact_oscillator.nml"
HYSTERESIS = SOURCE / "inputs" / "hysteresis.nml"
RIGID = "law='rigid', restitution=0.8"


def follow(case, *options, **values):
    """Follow a case, and open the file."""
    succeed("razy-follow", case, *options, *sets(**values))
    return h5py.File(f"{case.stem}.h5")


def points(file, label, branch=1):
    """Return the parameter at the special points of a kind on a branch."""
    keep = (file["special/label"].asstr()[:] == label) & (file["special/branch"][:] == branch)
    return file["special/parameter"][:][keep]


def labels(file, branch):
    """Labels and values of the special points of a branch, in its order."""
    mine = file["special/branch"][:] == branch
    return list(zip(file["special/label"].asstr()[:][mine], file["special/parameter"][:][mine], strict=True))


def multipliers(file, point=0):
    real, imaginary = file["point/multiplier"][point]
    return np.sort_complex(real + 1j * imaginary)


def oscillator(stop, load, follow_group, name="touch", damping=0.1, method=""):
    """x'' + damping x' + x = A cos omega t with a stop at 1."""
    text = ["&scene kind='lumped' /", "&mass name='m', value=1.0 /"]
    text += [f"&spring between='m','frame', stiffness=1.0, damping={damping} /"]
    text += [f"&stop name='stop', between='m','frame', clearance=1.0, {stop} /"]
    text += [f"&load on='m', {load} /", f"&follow {follow_group} /"]
    text += [f"&motion t_end=6000.0, start='zero'{method} /", "&record observable='displacement', what='extrema' /"]
    Path(f"{name}.nml").write_text("\n".join(text) + "\n")
    return follow(Path(f"{name}.nml"))
