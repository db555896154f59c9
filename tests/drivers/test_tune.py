"""What razy-tune finds, says and writes."""

import math
import re

import f90nml
import h5py
import numpy as np
import pytest
import xarray
from programs import SOURCE, attribute, changed, datasets, left, plot, sets, start, succeed

PRESS = SOURCE / "inputs" / "vibropress_vertical.nml"


def tuned(*options):
    done = succeed("razy-tune", PRESS, *options, "--output", "tuned.h5", "--force")
    with h5py.File("tuned.h5") as file:
        return done.stderr, {name: item[()] for name, item in file.items()}


def k1(hertz):
    """Solve det(K - w²M) = 0 of the vertical block, linear in k1."""
    w2 = (2 * math.pi * hertz) ** 2
    pallet, mould = 6e7 - 100 * w2, 1.2e8 - 425 * w2
    return 1020 * w2 - 2e7 + 4e14 * mould / (pallet * mould - 4e14)


def test_the_press_is_tuned_to_its_exciter():
    said, data = tuned()
    assert data["optimum"] == pytest.approx(8.956e7, rel=1e-4)
    assert data["optimum"] == pytest.approx(k1(50.0), rel=1e-12)
    np.testing.assert_allclose(data["frequency_before"], [39.22, 80.61, 126.70], atol=0.005)
    np.testing.assert_allclose(data["frequency_after"], [50.0, 80.66, 126.75], atol=0.005)
    assert data["frequency_after"][0] == pytest.approx(50.0, rel=1e-12)
    assert data["reference"] == 5e7 and data["goal"] == 50.0
    assert data["share"] == pytest.approx(0.9758, abs=1e-4)
    first = said.splitlines()[0]
    assert re.match(r"spring\(1\)%stiffness = 8\.95577\d+e7 .*mostly table has 50\.000000 Hz", first)


@pytest.mark.parametrize("frequency", [40.0, 45.5, 60.0, 77.5, 83.5, 100.0])
def test_any_frequency_in_reach(frequency):
    _, data = tuned(*sets(tune__frequency=frequency))
    assert data["optimum"] == pytest.approx(k1(frequency), rel=1e-10)
    assert np.abs(data["frequency_after"] / frequency - 1).min() < 1e-12


@pytest.mark.parametrize("case", ["vibropress", "thesis/fig_4_26"])
def test_the_whole_press(case):
    """All frequencies of table 4.3; table.y belongs to the vertical block, which the others cross."""
    done = succeed("razy-tune", SOURCE / "inputs" / f"{case}.nml", "--output", "press.h5")
    with h5py.File("press.h5") as file:
        before, after, optimum = (file[name][()] for name in ("frequency_before", "frequency_after", "optimum"))
    table = [39.22, 53.25, 80.61, 107.57, 126.70, 153.59, 206.92, 225.08, 272.50]
    np.testing.assert_allclose(before, table, atol=0.005)
    table = [50.00, 59.18, 80.66, 107.57, 126.75, 156.01, 225.08, 240.61, 272.52]
    np.testing.assert_allclose(after, table, atol=0.005)
    assert optimum == pytest.approx(k1(50.0), rel=1e-10)
    assert done.stderr.count("crossing: the mode that is mostly table.y goes from place 1 to 2") == 1
    assert "veering" not in done.stderr


def test_curves():
    _, data = tuned()
    parameter, frequency, found = data["parameter"], data["frequency"], data["tuned_frequency"]
    assert parameter[0] == 2e7 and parameter[-1] == 4e8 and parameter.size == 201
    assert frequency.shape == (201, 3)
    np.testing.assert_allclose(data["objective"], (1 - found / 50.0) ** 2, rtol=1e-13)
    for hertz, value in zip(found, parameter, strict=True):
        assert k1(hertz) == pytest.approx(value, rel=1e-9)
    # The mode that is mostly the table is the first up to the veering with the mould, then the second.
    below = parameter < 2.5018807e8
    np.testing.assert_array_equal(data["tuned_place"], np.where(below, 1, 2))
    np.testing.assert_array_equal(found, np.where(below, frequency[:, 0], frequency[:, 1]))
    assert np.all(np.diff(frequency, axis=0) >= 0.0)


def test_number_of_points_and_modes():
    _, data = tuned(*sets(tune__points=11, tune__modes=2))
    np.testing.assert_allclose(data["parameter"], np.linspace(2e7, 4e8, 11))
    assert data["frequency"].shape == (11, 2)
    assert data["frequency_after"].shape == (3,)


def test_veering_is_said():
    said, _ = tuned()
    assert "veering: the mode that is mostly table is number 1 below and 2 above, with a gap from 77.70" in said
    said, _ = tuned(*sets(tune__last=2e8))
    assert "veering" not in said


def test_crossing_is_said(folder):
    """Two uncoupled masses: the one that is tuned crosses the other."""
    (folder / "case.nml").write_text(
        "&scene kind='lumped' /\n&mass name='a', value=1.0 /\n&mass name='b', value=1.0 /\n"
        "&spring between='a','frame', stiffness=1.0 /\n&spring between='b','frame', stiffness=4.0 /\n"
        "&tune parameter='spring(1)%stiffness', first=1.0, last=9.0, coordinate='a', frequency=0.4 /\n"
    )
    done = succeed("razy-tune", "case.nml")
    assert "crossing: the mode that is mostly a goes from place 1 to 2 at 0.3183 Hz" in done.stderr
    with h5py.File("case.h5") as file:
        assert file["optimum"][()] == pytest.approx((0.8 * math.pi) ** 2, rel=1e-13)
        np.testing.assert_allclose(file["frequency"][:, 1], 1 / math.pi, rtol=1e-14)
        assert file["tuned_place"][0] == 1 and file["tuned_place"][-1] == 2


def test_mode_by_number(folder):
    case = changed(folder / "case.nml", PRESS.read_text(), ("coordinate='table', frequency=50", "mode=2, frequency=82"))
    done = succeed("razy-tune", case)
    with h5py.File("case.h5") as file:
        assert file["optimum"][()] == pytest.approx(k1(82.0), rel=1e-10)
    assert "mode 2 turns from mostly mould to mostly table at" in done.stderr


@pytest.mark.parametrize(
    ("parameter", "first", "last", "coordinate", "frequency"),
    [
        ("mass(3)%value", 1.0, 5000.0, "mould", 60.0),
        ("mass(1)%value", 3000.0, 100.0, "table", 50.0),
        ("stop(1)%stiffness", 1e3, 1e9, "table", 40.0),
    ],
)
def test_any_parameter(parameter, first, last, coordinate, frequency):
    """The tuned machine has the frequency when it is made anew."""
    options = ["--set", f"tune%parameter='{parameter}'", "--set", f"tune%coordinate='{coordinate}'"]
    options += sets(tune__first=first, tune__last=last, tune__frequency=frequency)
    _, data = tuned(*options)
    _, again = tuned(*options, "--set", f"{parameter}={float(data['optimum'])!r}")
    assert again["reference"] == data["optimum"]
    assert np.abs(again["frequency_before"] / frequency - 1).min() < 1e-12
    assert np.all(np.diff(data["parameter"]) > 0)


def test_contacts():
    """Open, the table stands on its spring alone; at rest all contacts but none under load are open too."""
    for contacts in ("open", "equilibrium"):
        _, data = tuned(*sets(tune__contacts=f"'{contacts}'"))
        assert data["optimum"] == pytest.approx(1020 * (100 * math.pi) ** 2, rel=1e-12)
    # Its weight presses the pallet on the bars and opens no other contact.
    _, data = tuned(*sets(tune__contacts="'equilibrium'", **{"load%on": "'pallet'", "load%value": "-1000.0"}))
    assert data["frequency_before"][1] == pytest.approx(math.sqrt(2e7 / 100) / (2 * math.pi), rel=1e-12)


MISTAKES = [
    (sets(tune__frequency=80.0, tune__last=2e8), "= 80.0: the mode that is mostly table has 28.3925 to 71.4877 Hz"),
    (sets(tune__frequency=80.62), "28.3925 to 77.7012 and 82.9781 to 100.3979 Hz for spring(1)%stiffness from 2.0e7"),
    (sets(tune__coordinate="'tabel'"), "did you mean 'table'?"),
    (sets(tune__coordinate="'zz'"), "table, pallet, mould"),
    (sets(tune__mode=1), "one of coordinate and mode has to be given"),
    (sets(tune__parameter="'spring%stiffness'"), "spring(1)%stiffness to spring(2)%stiffness"),
    (sets(tune__parameter="'tune%first'"), "a value of another group than &tune"),
    (sets(tune__first=-1.0), "must be a nonnegative real number"),
    (sets(tune__last=2e7), "a value apart from first"),
    (sets(tune__frequency=-1.0), "must be a positive real number in Hz"),
    (sets(tune__points=1), "2 to 100000"),
    (sets(tune__contacts="'shut'"), "must be one of 'closed', 'open', 'equilibrium'"),
]  # fmt: skip


@pytest.mark.parametrize(("options", "says"), MISTAKES)
def test_mistake(options, says):
    done = start("razy-tune", PRESS, *options, timeout=20)
    assert done.returncode == 2
    assert done.stdout == "" and done.stderr.count("\n") == 1
    assert "&tune" in done.stderr and says in done.stderr
    assert left() == []


def test_without_tune(folder):
    changed(folder / "case.nml", PRESS.read_text(), ("(?m)^&tune.*\n", ""))
    done = start("razy-tune", "case.nml")
    assert done.returncode == 2
    assert "&tune parameter: required" in done.stderr


def test_no_equilibrium(folder):
    text = "&scene kind='lumped' /\n&mass name='a', value=1.0 /\n&load on='a', value=1.0 /\n"
    text += "&stop name='s', between='a','frame', clearance=0.0, side='lower', stiffness=1.0 /\n"
    text += "&tune parameter='mass%value', first=1.0, last=2.0, mode=1, frequency=1.0, contacts='equilibrium' /\n"
    (folder / "case.nml").write_text(text)
    done = start("razy-tune", "case.nml")
    assert done.returncode == 2
    assert "no equilibrium" in done.stderr and done.stderr.count("\n") == 1


def test_check_and_effective_input(folder):
    done = succeed("razy-tune", PRESS, "--check")
    assert f90nml.reads(done.stdout)["tune"]["coordinate"] == "table"
    assert left() == []
    succeed("razy-tune", PRESS)
    text = attribute("vibropress_vertical.h5", "input")
    assert text == done.stdout
    (folder / "again.nml").write_text(text)
    succeed("razy-tune", "again.nml")
    assert datasets("again.h5") == datasets("vibropress_vertical.h5")


@pytest.mark.parametrize("engine", ["h5netcdf", "netcdf4"])
def test_xarray_reads_the_file_alone(engine):
    succeed("razy-tune", PRESS)
    with xarray.open_dataset("vibropress_vertical.h5", engine=engine) as data:
        assert data["frequency"].dims == ("parameter", "mode")
        assert data["objective"].dims == ("parameter",)
        assert data["frequency_after"].dims == ("order",)
        assert data["optimum"].dims == ()
        assert float(data["frequency"].sel(mode=1).interp(parameter=data["optimum"])) == pytest.approx(50.0, abs=1e-3)
        for variable in data.variables.values():
            assert variable.attrs["units"] and variable.attrs["long_name"]


def test_picture():
    succeed("razy-tune", PRESS)
    done = plot("vibropress_vertical.h5", "--save", "picture.png")
    assert done.returncode == 0, done.stderr
