"""Spectra, Poincaré sections, orbits, contact patterns, damping ratios: against motions in closed form."""

import warnings

import h5py
import numpy as np
import pytest
from pictures import drawn, line
from samples import BRANCHES, dataset, root, write_modes, write_run, write_sweep

import razy
from razy.plot import PlotNote, PlotOptions
from razy.plot.sampled import Course
from razy.plot.signals import signals
from razy.plot.spectrum import order_map, spectrum
from razy.read import ResultError, open_result

SPEED = 3000.0


def write_motion(path, time, speed=SPEED, period=0.02, **signals):
    """Write observables over time of a motion that is excited with a period, at a speed of rotation."""
    with root(path, "razy-run", "Motion") as file:
        file.attrs["input"] = f"&rotation\n   speed_rpm = {speed}\n/\n&load\n   value = 2.0\n/\n"
        dataset(file, "time", time, "s", "time")
        for name, value in signals.items():
            dataset(file, f"observable/{name.replace('__', '.')}", value, "m", name)
        if period is not None:
            dataset(file, "outcome/excitation_period", np.array([period]), "s")
    return path


def test_spectrum_has_the_amplitudes_of_sines(tmp_path):
    time = np.arange(4000) / 4000.0
    value = 5.0 + 2.0 * np.sin(2 * np.pi * 50 * time) + 0.01 * np.cos(2 * np.pi * 310 * time)
    frequency, amplitude = spectrum(value, 1 / 4000.0)
    assert amplitude[frequency == 50.0] == pytest.approx(2.0)
    assert amplitude[frequency == 310.0] == pytest.approx(0.01)
    assert np.max(amplitude[np.abs(frequency - 50) * np.abs(frequency - 310) > 1000]) < 1e-12
    (axes,) = drawn(write_motion(tmp_path / "run.h5", time, d=value), kind="spectrum", top=500.0).axes
    x, y = line(axes, "d")
    assert y[x == 50.0] == pytest.approx(2.0) and axes.get_xlim() == (0.0, 500.0)
    assert line(axes, "excitation")[0][0] == pytest.approx(50.0)


def test_uneven_times_are_interpolated_with_a_note(tmp_path):
    even = np.linspace(0.0, 1.0, 4001)
    time = np.sort(np.concatenate((even + 5e-5 * np.sin(40 * np.pi * even), [0.25, 0.25])))
    path = write_motion(tmp_path / "run.h5", time, d=np.sin(2 * np.pi * 50 * time), period=None)
    with pytest.warns(PlotNote, match="not evenly spaced"):
        (axes,) = drawn(path, kind="spectrum").axes
    x, y = line(axes, "d")
    assert y[np.argmin(np.abs(x - 50.0))] == pytest.approx(1.0, rel=1e-3)
    assert np.max(y[np.abs(x - 50.0) > 5.0]) < 1e-3
    assert len(axes.lines) == 1


def test_spectrogram_shows_when_a_frequency_comes(tmp_path):
    time = np.arange(8000) / 4000.0
    value = np.where(time < 1.0, np.sin(2 * np.pi * 100 * time), np.sin(2 * np.pi * 400 * time))
    axes, _ = drawn(write_motion(tmp_path / "run.h5", time, d=value), kind="spectrogram").axes
    mesh = axes.collections[0]
    edges = mesh.get_coordinates()
    middle = 0.5 * (edges[:-1, :-1] + edges[1:, 1:])
    loudest = middle[:, 0, 1][np.asarray(mesh.get_array()).argmax(axis=0)]
    at = middle[0, :, 0]
    assert np.all(np.abs(loudest[at < 0.9] - 100) < 6) and np.all(np.abs(loudest[at > 1.1] - 400) < 6)


@pytest.mark.parametrize(("begin", "rate"), [(0.0, 40.0), (200.0, -40.0)])
def test_order_map_has_orders_level_and_frequencies_falling(tmp_path, begin, rate):
    """Orders 1 and 5, and 90 Hz, which at the speed n is the order 90 Hz/n."""
    time = np.linspace(0.0, 5.0, 5001)
    phase = begin * time + rate * time**2 / 2
    path = write_motion(
        tmp_path / "run.h5", time, d=2.0 * np.sin(phase) + np.cos(5 * phase) + 0.5 * np.sin(2 * np.pi * 90 * time)
    )
    with pytest.raises(ResultError, match="the speed does not change"):
        drawn(path, kind="ordermap")
    with h5py.File(path, "a") as file:
        dataset(file, "rotation/time", np.array([0.0, 5.0]), "s", "time")
        dataset(file, "rotation/speed", begin + rate * np.array([0.0, 5.0]), "rad/s", "speed")
    with open_result(path) as result:
        speed, order, amplitude = order_map(Course(result, signals(result, PlotOptions(), 1)[0], PlotOptions()), result)
    assert np.all(np.diff(speed) * rate > 0) and order[1] == pytest.approx(1 / 6)
    fast = speed > 1400.0
    for one, size in ((1.0, 2.0), (5.0, 1.0)):
        np.testing.assert_allclose(amplitude[:, np.argmin(np.abs(order - one))][fast], size, rtol=0.05)
    between = (order > 1.5) & (order < 4.5)
    row = np.argmin(np.abs(speed - 1800.0))
    assert order[between][amplitude[row][between].argmax()] == pytest.approx(90 / (speed[row] / 60), abs=0.2)
    axes, _ = drawn(path, kind="ordermap", top=6.0).axes
    assert axes.get_xlabel() == "speed (rpm)" and axes.get_ylim() == (0.0, 6.0)
    assert axes.get_ylabel() == f"order (apart by 0.17, stored to {order[-1]:.3g})"


def test_what_is_folded_is_said(tmp_path):
    """A tone of 600 Hz, which 1 kHz shows at 400 Hz; at 1.2001 kHz it stands where it is."""
    for rate, folded in ((1000, True), (1200.1, False)):
        time = np.arange(6000) / rate
        path = write_motion(tmp_path / "run.h5", time, d=np.sin(2 * np.pi * 600 * time), period=None)
        with h5py.File(path, "a") as file:
            dataset(file, "outcome/fastest_excitation", np.array([600.0]), "Hz")
            dataset(file, "rotation/time", np.array([0.0, time[-1]]), "s", "time")
            dataset(file, "rotation/speed", np.array([100.0, 120.0]), "rad/s", "speed")
        for kind in ("ordermap", "spectrum", "spectrogram"):
            with warnings.catch_warnings(record=True) as notes:
                warnings.simplefilter("always")
                axes = drawn(path, kind=kind).axes
            said = [str(note.message) for note in notes]
            assert [note.startswith("fewer than two stored times in a period") for note in said] == [True] * folded
            if kind == "spectrum":
                x, y = line(axes[0], "d")
                assert x[y.argmax()] == pytest.approx(400.0 if folded else 600.0, abs=1.0)


def test_waterfall_over_the_speed_has_lines_of_orders(tmp_path):
    time = np.arange(2000) / 2000.0
    runs = [
        razy.open(write_motion(tmp_path / f"{speed}.h5", time, float(speed), 30.0 / speed,
                               d=np.sin(2 * np.pi * speed / 30.0 * time)))
        for speed in (3000, 1500, 2400)
    ]  # fmt: skip
    axes, _ = runs[0].razy.plot.waterfall(beside=runs[1:], top=400.0).axes
    mesh = axes.collections[0]
    edges = mesh.get_coordinates()
    loudest = 0.5 * (edges[:-1, 0, 1] + edges[1:, 0, 1])[np.asarray(mesh.get_array()).argmax(axis=0)]
    np.testing.assert_allclose(loudest, [50.0, 80.0, 100.0], atol=1.0)
    x, y = line(axes, "order 2")
    np.testing.assert_allclose(y, x / 30.0)
    assert axes.get_xlabel() == "speed (rpm)" and axes.get_ylim() == (0.0, 400.0)
    with pytest.raises(ResultError, match="two of the motions have the same"):
        runs[0].razy.plot.waterfall(beside=[runs[1], runs[1]])
    with pytest.raises(ResultError, match="differ in a number of the input"):
        runs[0].razy.plot.waterfall()


def test_order_cuts_have_the_amplitudes_at_multiples_of_the_speed(tmp_path):
    time = np.arange(2000) / 2000.0
    runs = []
    for speed in (3000, 1530, 2400):
        turns = 2 * np.pi * speed / 60.0 * time
        value = 1e-3 * speed * np.sin(turns) + 0.7 * np.cos(3 * turns + 0.3) + 4.0
        runs.append(razy.open(write_motion(tmp_path / f"{speed}.h5", time, float(speed), 60.0 / speed, d=value)))
    (axes,) = runs[0].razy.plot.orders(beside=runs[1:]).axes
    for name, expected in (("order 1", [1.53, 2.4, 3.0]), ("order 2", [0.0] * 3), ("order 3", [0.7] * 3)):
        x, y = line(axes, name)
        np.testing.assert_array_equal(x, [1530.0, 2400.0, 3000.0])
        np.testing.assert_allclose(y, expected, atol=0.01)
    assert axes.get_xlabel() == "speed (rpm)" and axes.get_ylabel().startswith("amplitude of d")
    with pytest.raises(ResultError, match="a picture of orders is of motions that differ"):
        runs[0].razy.plot.orders()


def test_poincare_section_is_taken_once_in_each_period(tmp_path):
    # 50 Hz excites, 50/3 Hz answers: three points.
    time = np.linspace(0.0, 1.0, 2988)
    phase = 2 * np.pi * 50 / 3 * time
    path = write_motion(tmp_path / "run.h5", time, d=np.cos(phase))
    (axes,) = drawn(path, kind="poincare", start=0.095).axes
    x, y = line(axes, "d")
    k = np.arange(5, 51)
    np.testing.assert_allclose(x, np.cos(2 * np.pi * k / 3), atol=1e-5)
    np.testing.assert_allclose(y, -50 / 3 * 2 * np.pi * np.sin(2 * np.pi * k / 3), atol=0.05)
    (axes,) = drawn(path, kind="poincare", period=0.06).axes
    np.testing.assert_allclose(line(axes, "d")[0], 1.0, atol=1e-5)
    free = write_motion(tmp_path / "free.h5", time, d=np.cos(phase), period=None)
    with pytest.raises(ResultError, match=r"give one \(--period\)"):
        drawn(free, kind="poincare")
    with pytest.raises(ResultError, match="no period of 5 s begins"):
        drawn(path, kind="poincare", period=5.0, start=0.1)


def test_orbit_has_a_mark_for_each_revolution(tmp_path):
    time = np.linspace(0.0, 0.2, 2001)
    turn = 2 * np.pi * SPEED / 60 * time
    signals = {"displacement__rotor__3__v": 1e-5 * np.cos(turn), "displacement__rotor__3__w": 2e-5 * np.sin(turn)}
    path = write_motion(tmp_path / "run.h5", time, **signals)
    (axes,) = drawn(path, kind="orbit").axes
    x, y = line(axes, "rotor.3")
    np.testing.assert_allclose((x / 10) ** 2 + (y / 20) ** 2, 1.0)
    x, y = line(axes, "once per revolution")
    np.testing.assert_allclose(x, 10.0, rtol=1e-6)
    np.testing.assert_allclose(y, 0.0, atol=1e-4)
    assert x.size == 11
    (arrow,) = axes.texts
    np.testing.assert_allclose(arrow.xy, (10.0, 0.0), atol=1e-4)
    np.testing.assert_allclose(arrow.xyann, (10 * np.cos(turn[-2]), 20 * np.sin(turn[-2])), rtol=1e-5)
    with pytest.raises(ResultError, match=r"no orbit of 'rotor.4' \(the file has: rotor.3\)"):
        drawn(path, kind="orbit", coordinates=("rotor.4",))
    with pytest.raises(ResultError, match="no orbit: it needs &record"):
        drawn(write_run(tmp_path / "lumped.h5"), kind="orbit")


@pytest.mark.parametrize(("begin", "change"), [(0.0, 400.0), (300.0, 100.0), (200.0, -400.0), (200.0, -1e-9)])
def test_marks_of_an_orbit_follow_a_speed_that_changes(tmp_path, begin, change):
    """A shaft that turns as fast as it whirls has its marks at one place: from rest, up, down and back, hardly."""
    time = np.linspace(0.0, 1.0, 20001)
    turn = begin * time + change * time**2 / 2
    signals = {"displacement__rotor__3__v": 1e-5 * np.cos(turn), "displacement__rotor__3__w": 1e-5 * np.sin(turn)}
    path = write_motion(tmp_path / "run.h5", time, begin * 30 / np.pi, **signals)
    with h5py.File(path, "a") as file:
        dataset(file, "rotation/time", np.array([0.0, 1.0]), "s", "time")
        dataset(file, "rotation/speed", begin + change * np.array([0.0, 1.0]), "rad/s", "speed")
    (axes,) = drawn(path, kind="orbit").axes
    x, y = line(axes, "once per revolution")
    np.testing.assert_allclose(x, 10.0, rtol=1e-5)
    np.testing.assert_allclose(y, 0.0, atol=0.02)
    passed = np.flatnonzero(np.diff(np.floor(turn / (2 * np.pi))))
    # Also at the ends of the motion.
    assert passed.size <= x.size <= passed.size + 2
    # So has a Poincaré section, here of v alone.
    (axes,) = drawn(path, kind="poincare", observables=("displacement.rotor.3.v",)).axes
    np.testing.assert_array_equal(line(axes, "displacement.rotor.3.v")[0], x)
    (axes,) = drawn(path, kind="orbit", start=0.6).axes
    assert line(axes, "once per revolution")[0].size - np.count_nonzero(time[passed] > 0.6) in (0, 1)


def test_pattern_shows_the_state_from_event_to_event(tmp_path):
    path = tmp_path / "run.h5"
    with root(path, "razy-run", "Motion") as file:
        dataset(file, "event/time", np.array([0.1, 0.2, 0.3, 0.35]), "s")
        dataset(file, "event/contact", np.array([1, 2, 1, 2], dtype=np.int32), names=["mesh", "stop"])
        dataset(file, "event/state", np.array([2, 2, 1, 1], dtype=np.int32), meanings=BRANCHES)
        dataset(file, "outcome/time", np.array([0.4]), "s")
    (axes,) = drawn(path, kind="pattern", start=0.15).axes
    bars = [(bar.get_y() + 0.35, bar.get_x(), bar.get_x() + bar.get_width()) for bar in axes.patches if bar.get_fill()]
    expected = [(0, 0.15, 0.3), (0, 0.3, 0.4), (1, 0.15, 0.2), (1, 0.2, 0.35), (1, 0.35, 0.4)]
    np.testing.assert_allclose(sorted(bars), expected)
    dark = [bar.get_x() for bar in axes.patches if bar.get_facecolor()[:3] == (43 / 255,) * 3]
    np.testing.assert_allclose(dark, [0.15, 0.2])
    (axes,) = drawn(path, kind="pattern", coordinates=("stop",)).axes
    assert [label.get_text() for label in axes.get_yticklabels()] == ["stop"]
    with pytest.raises(ResultError, match="no contact 'stops'"):
        drawn(path, kind="pattern", coordinates=("stops",))


def test_damping_ratios(tmp_path):
    path = write_modes(tmp_path / "modes.h5")
    with h5py.File(path, "r+") as file:
        omega = 2 * np.pi * file["frequency"][:]
        dataset(file, "eigenvalue", np.stack((-0.03 * omega, omega), axis=-1), "1/s")
    (axes,) = drawn(path, kind="damping").axes
    for number in (1, 2, 3):
        np.testing.assert_allclose(line(axes, f"branch {number}")[1], 100 * 0.03 / np.hypot(0.03, 1.0))


def test_options_where_they_do_not_belong(tmp_path):
    sweep = write_sweep(tmp_path / "sweep.h5", np.linspace(1.0, 2.0, 3), {})
    with pytest.raises(ResultError, match="--period goes with"):
        drawn(sweep, period=1.0)
    with pytest.raises(ResultError, match="fewer than four stored times"):
        drawn(write_run(tmp_path / "run.h5"), kind="spectrum", start=0.24999)


def write_response(path):
    """Write the response 1/(1 - s² + 0.2 i s) of `d` and a velocity over s, and its peak."""
    at = np.linspace(0.0, 2.0, 201)
    value = 1e-3 / (1 - at**2 + 0.2j * at)
    write_modes(path)
    with h5py.File(path, "r+") as file:
        file.attrs["input"] = "&response\n   operating = 1.5, 1.75\n/\n"
        dataset(file, "response/parameter", at, "rpm", "rotation%speed_rpm")
        for name, units in (("displacement.a.v", "m"), ("velocity.a.v", "m/s")):
            parts = np.stack((value.real, value.imag), axis=-1)[:, None, :]
            dataset(file, f"response/phasor/{name}", parts, units, f"{name}, real and imaginary part of its phasor")
        dataset(file, "response/peak_observable", ["displacement.a.v"])
        for name, number in (
            ("peak_tone", 1.0), ("peak_parameter", 0.99), ("peak_amplitude", 5.025e-3), ("amplification_factor", 5.0),
        ):  # fmt: skip
            dataset(file, f"response/{name}", np.array([number]))
    return path


def test_bode_and_polar(tmp_path):
    path = write_response(tmp_path / "modes.h5")
    upper, lower = drawn(path, kind="bode").axes
    x, y = line(upper, "displacement a v")
    np.testing.assert_allclose(y, 1.0 / np.abs(1 - x**2 + 0.2j * x))
    np.testing.assert_allclose(line(lower, "displacement a v")[1], -np.degrees(np.arctan2(0.2 * x, 1 - x**2)))
    assert line(upper, "peak")[0] == pytest.approx([0.99])
    assert [text.get_text() for text in upper.texts] == ["0.99, AF 5.0"]
    assert upper.patches[0].get_x() == 1.5 and upper.patches[0].get_width() == 0.25
    assert lower.get_xlabel() == "speed (rpm)"
    (axes,) = drawn(path, kind="polar", start=0.5, stop=1.5).axes
    angle, size = line(axes, "displacement a v")
    x = x[50:151]
    np.testing.assert_allclose(size * np.exp(1j * angle), 1.0 / (1 - x**2 + 0.2j * x))
    with pytest.raises(ResultError, match="one unit, not m, m/s"):
        drawn(path, kind="bode", observables=("displacement.a.v", "velocity.a.v"))
    with pytest.raises(ResultError, match=r"did you mean 'velocity\.a\.v'"):
        drawn(path, kind="polar", observables=("velocity.a.w",))
    with pytest.raises(ResultError, match="has no response"):
        drawn(write_modes(tmp_path / "plain.h5"), kind="bode")
