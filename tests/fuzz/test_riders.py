"""Bodies that ride on others by friction alone, which always sticks: motions and multipliers in closed form."""

import os
import random
import subprocess
from pathlib import Path

import h5py
import numpy as np
import pytest

BIN = Path(os.environ["RAZY_BUILD"]) / "bin"
FIRST, LAST = (int(number) for number in os.environ.get("RAZY_FUZZ_SEEDS", "0:20").split(":"))


def machine_of(seed):
    """Groups; of each mass the held body it rides on, and whether it is one; M, B, K, the loaded body, frequency."""
    draw = random.Random(seed)
    held = [f"b{i}" for i in range(draw.randint(1, 3))]
    groups, names, root = [], list(held), {name: i for i, name in enumerate(held)}
    mass, damping, stiffness = (np.zeros((len(held), len(held))) for _ in range(3))
    for i, name in enumerate(held):
        mass[i, i] = draw.choice([0.5, 1.0, 2.0])
        groups.append(f"&mass name='{name}', value={mass[i, i]} /")
        other = draw.choice(["frame", *held[:i]])
        k, b = draw.choice([50.0, 100.0, 400.0]), draw.choice([0.5, 1.0, 2.0])
        groups.append(f"&spring between='{name}','{other}', stiffness={k}, damping={b} /")
        stretch = np.eye(len(held))[i] - (0 if other == "frame" else np.eye(len(held))[root[other]])
        stiffness += k * np.outer(stretch, stretch)
        damping += b * np.outer(stretch, stretch)
    for i in range(draw.randint(1, 3)):
        name, on, value = f"r{i}", draw.choice(names), draw.choice([0.25, 0.5, 1.0])
        root[name] = root[on]
        mass[root[on], root[on]] += value
        groups.append(f"&mass name='{name}', value={value} /")
        ends = "','".join(draw.sample([name, on], 2))
        limit = f"kinetic_coefficient={draw.choice([1.0, 0.8])}, static_coefficient=1.0, normal_load=1000.0"
        for twin in "fg"[: draw.choice([1, 1, 1, 2])]:
            groups.append(f"&friction name='{twin}{i}', between='{ends}', {limit} /")
        names.append(name)
    on, amplitude, omega = draw.choice(names), draw.choice([1.0, 5.0, 20.0]), draw.choice([1.0, 2.0, 5.0])
    groups.append(f"&load on='{on}', amplitude={amplitude}, angular_frequency={omega} /")
    groups += [f"&record observable='displacement', of='{name}', what='extrema' /" for name in names]
    groups.append(f"&motion t_end={600 * np.pi / omega}, start='zero' /")
    groups.append(f"&follow parameter='load(1)%amplitude', first={amplitude}, last={1.5 * amplitude}, max_points=12 /")
    draw.shuffle(groups)
    order = [group.split("'")[1] for group in groups if group.startswith("&mass")]
    return (
        groups,
        [root[name] for name in order],
        [name in held for name in order],
        mass,
        damping,
        stiffness,
        root[on],
        omega,
    )


@pytest.mark.parametrize("seed", range(FIRST, LAST))
def test_random_riders(seed, tmp_path):
    groups, root, held, mass, damping, stiffness, loaded, omega = machine_of(seed)
    (tmp_path / "riders.nml").write_text("\n".join(groups) + "\n")
    command = [BIN / "razy-follow", "riders.nml", "--output", "riders.h5"]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    response = np.linalg.solve(stiffness - omega**2 * mass + 1j * omega * damping, np.eye(len(mass))[loaded])
    inverse = np.linalg.inv(mass)
    free = np.block([[0 * mass, np.eye(len(mass))], [-inverse @ stiffness, -inverse @ damping]])
    expected = np.exp(np.linalg.eigvals(free) * 2 * np.pi / omega)
    with h5py.File(tmp_path / "riders.h5") as file:
        point = {
            name: file["point"][name][:] for name in ("state", "phase", "multiplier", "stable", "load(1).amplitude")
        }
    assert len(point["phase"]) > 1 and (point["stable"] == 1).all()
    for i, phase in enumerate(point["phase"]):
        # The load is a sine; what rides lies anywhere, and moves along.
        moves = point["load(1).amplitude"][i] * response[root] * np.exp(2j * np.pi * phase)
        size = np.abs(moves).max()
        displacement, velocity = point["state"][i].reshape(2, -1)
        assert displacement[held] == pytest.approx(moves[held].imag, abs=1e-9 * size)
        assert velocity == pytest.approx((1j * omega * moves).imag, abs=1e-9 * size * omega)
        found = point["multiplier"][i][0] + 1j * point["multiplier"][i][1]
        apart = np.abs(expected[:, None] - found)
        assert (apart.min(axis=1) < 1e-7).all()
        assert (np.abs(found[np.argsort(apart.min(axis=0))[len(expected) :]]) < 1e-7).all()
