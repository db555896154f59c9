"""razy-merge: the parts of a sweep, computed one by one, make the file of the whole."""

from pathlib import Path

import h5py
import numpy as np
from programs import SOURCE, call, datasets, sets, succeed

BASINS = SOURCE / "inputs" / "basins.nml"
SHORT = sets(motion__t_end="4.0", record__from="3.5")
COARSE = [*SHORT, "--set", "start_range(1)%points=3", "--set", "start_range(2)%points=2"]
PAIR = SOURCE / "inputs" / "torsional_gear_pair.nml"
TWO_AXES = """
&sweep parameter='load(1)%value','load(2)%value', factor=1.0,-1.0, first=60.0, last=120.0, step=20.0 /
"""


def merge(*arguments):
    return call("razy.tools.cli", *arguments, main="merge_main")


def compute(case, name, *options):
    succeed("razy-sweep", case, "--output", name, *options)
    return name


def expect_whole(*parts):
    done = merge(*parts, "--output", "all.h5")
    assert done.returncode == 0, done.stderr
    expected, found = datasets("whole.h5"), datasets("all.h5")
    assert expected.keys() == found.keys()
    assert [name for name, value in expected.items() if found[name] != value] == []
    with h5py.File("all.h5") as file, h5py.File("whole.h5") as whole:
        for name in expected:
            scales = [[scale.name for scale in dimension.values()] for dimension in whole[name].dims]
            assert [[scale.name for scale in dimension.values()] for dimension in file[name].dims] == scales, name


def ranges(prefix, first, last):
    return ["--set", f"{prefix}%first={first}", "--set", f"{prefix}%last={last}"]


def test_means_and_strobes_are_merged(folder):
    case = (SOURCE / "inputs" / "field" / "capsule.nml").read_text()
    for name, first, last, points in (("whole", 0.8, 1.1, 4), ("a", 0.8, 0.9, 2), ("b", 1.0, 1.1, 2)):
        sweep = f"&sweep parameter='load%angular_frequency', first={first}, last={last}, points={points} /\n"
        (folder / "case.nml").write_text(case[: case.index("&sweep")] + sweep)
        compute("case.nml", f"{name}.h5")
    done = merge("a.h5", "b.h5", "--output", "all.h5")
    assert done.returncode == 0, done.stderr
    with h5py.File("all.h5") as file, h5py.File("whole.h5") as whole:
        for name in ("average/velocity.capsule/rms", "strobe/velocity.capsule/value", "strobe/velocity.capsule/offset"):
            assert len(whole[name]) >= 4
            np.testing.assert_allclose(file[name][()], whole[name][()], rtol=1e-8, atol=1e-8)


def test_starts_and_attractors(folder):
    options = [*COARSE, *sets(sweep__points=4)]
    compute(BASINS, "whole.h5", *options, *ranges("sweep", 20.0, 26.0))
    halves = [*COARSE, *sets(sweep__points=2)]
    compute(BASINS, "b.h5", *halves, *ranges("sweep", 24.0, 26.0))
    compute(BASINS, "a.h5", *halves, *ranges("sweep", 20.0, 22.0))
    expect_whole("b.h5", "a.h5")
    with h5py.File("all.h5") as file:
        assert file["attractor/offset"].shape == (5,)
        assert file.attrs["merged"] == "a.h5, b.h5"


def two_axes(folder):
    text = PAIR.read_text().rstrip() + TWO_AXES
    (folder / "two.nml").write_text(text)
    return folder / "two.nml"


FEW = [*sets(motion__t_end="0.05"), "--set", "record(1)%from=0.04", *ranges("sweep(1)", 1500.0, 1540.0)]
BOTH = ["--set", "sweep(1)%direction='both'"]


def test_chains_along_the_other_parameter(folder):
    case = two_axes(folder)
    compute(case, "whole.h5", *FEW, *BOTH)
    compute(case, "a.h5", *FEW, *BOTH, *ranges("sweep(2)", 60.0, 80.0))
    compute(case, "b.h5", *FEW, *BOTH, *ranges("sweep(2)", 80.0, 120.0))
    expect_whole("a.h5", "b.h5")


def test_ways_up_and_down(folder):
    case = two_axes(folder)
    compute(case, "whole.h5", *FEW, *BOTH)
    for way in ("down", "up"):
        compute(case, f"{way}.h5", *FEW, "--set", f"sweep(1)%direction='{way}'")
    expect_whole("down.h5", "up.h5")


def test_chains_along_their_own_parameter_are_refused(folder):
    case = two_axes(folder)
    for name, last in (("a", (1500.0, 1520.0)), ("b", (1520.0, 1540.0))):
        compute(case, f"{name}.h5", *FEW, *BOTH, *ranges("sweep(1)", *last))
    done = merge("a.h5", "b.h5", "--output", "all.h5")
    assert done.returncode == 2 and "began anew" in done.stderr and done.stderr.count("\n") == 1
    assert not Path("all.h5").exists()


def test_other_starts_and_other_ways_are_refused(folder):
    case = [*COARSE, *sets(sweep__points=2)]
    compute(BASINS, "a.h5", *case, *ranges("sweep", 20.0, 22.0))
    compute(BASINS, "b.h5", *case, *ranges("sweep", 24.0, 26.0), "--set", "start_range(2)%points=3")
    done = merge("a.h5", "b.h5", "--output", "all.h5")
    assert done.returncode == 2 and "another input" in done.stderr
    compute(BASINS, "up.h5", *case, *ranges("sweep", 24.0, 26.0), *sets(sweep__direction="'up'"))
    done = merge("a.h5", "up.h5", "--output", "all.h5")
    assert done.returncode == 2 and "direction" in done.stderr
