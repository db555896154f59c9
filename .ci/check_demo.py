"""Whether the files of the demo are complete: exit code 1 and a message if not."""

import sys

import h5py
import matplotlib.image
import numpy as np

results, picture = sys.argv[1:]
with h5py.File(results) as file:
    speed = file["axis/rotation.speed_rpm"][:]
    status = file["point/status"][:]
    offset = file["extrema/mesh_deformation/offset"][:]
    value = file["extrema/mesh_deformation/value"][:]
if not np.array_equal(speed, 1000.0 + 4.0 * np.arange(401)):
    sys.exit(f"{results}: the speeds are not 1000, 1004, ... 2600 rpm")
if status.any():
    sys.exit(f"{results}: {np.count_nonzero(status)} points failed")
if np.diff(offset).min() < 2 or offset[-1] != value.size or not np.isfinite(value).all():
    sys.exit(f"{results}: extrema are missing")
pixels = matplotlib.image.imread(picture)
if min(pixels.shape[:2]) < 300 or pixels[..., :3].std() < 0.01:
    sys.exit(f"{picture}: the picture is empty")
