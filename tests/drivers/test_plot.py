"""razy-plot on the files of the programs."""

from pathlib import Path

import matplotlib.image
import pytest
from programs import GEAR_PAIR, TWO_SIDED_STOP, plot, sets, succeed


def check_picture(path):
    pixels = matplotlib.image.imread(path)
    assert min(pixels.shape[:2]) > 300
    assert pixels[..., :3].std() > 0.01
    return pixels


def test_sweep():
    succeed("razy-sweep", GEAR_PAIR, *sets(sweep__step=20))
    done = plot("torsional_gear_pair.h5", "--save", "picture.png")
    assert done.returncode == 0, done.stderr
    pixels = check_picture("picture.png")[..., :3]
    assert (pixels.max(axis=2) < 0.1).sum() > 500
    grey = (pixels.min(axis=2) > 0.4) & (pixels.max(axis=2) < 0.7)
    assert grey.sum() > 500


@pytest.mark.parametrize("kind", ["overview", "time", "phase"])
def test_run(kind):
    succeed("razy-run", TWO_SIDED_STOP)
    done = plot("two_sided_stop.h5", "--kind", kind, "--save", "picture.png")
    assert done.returncode == 0, done.stderr
    check_picture("picture.png")


def test_run_of_extrema_alone():
    succeed("razy-run", GEAR_PAIR)
    assert plot("torsional_gear_pair.h5", "--save", "picture.png").returncode == 0
    check_picture("picture.png")


def test_what_is_no_result_file():
    Path("text.h5").write_text("no HDF5")
    for name in ("text.h5", "missing.h5"):
        done = plot(name, "--save", "picture.png")
        assert done.returncode == 2
        assert name in done.stderr and done.stderr.count("\n") == 1
    assert not Path("picture.png").exists()
