"""Every kind of picture: no text leaves it, none lies over another, none is a formula that was not set."""

import warnings

import numpy as np
import pytest
import samples
from matplotlib.figure import Figure
from pictures import drawn
from texts import boxes, misplaced

from razy.plot import KINDS, OVER_MOTIONS, PlotOptions, draw_files, style, units
from razy.read import open_result

LONG = "displacement of a place with a long name"


def motion(path, speed=3000.0):
    """Write two observables with long names, and both of a shaft's node, of a run-up that folds nothing."""
    time = np.arange(4000) / 4000.0
    turn = 2 * np.pi * (speed / 60.0 * time + 10.0 * time**2)
    with samples.root(path, "razy-run", "Rotor on two bearings, of which the second is worn, running up") as file:
        file.attrs["input"] = (
            f"&scene\n   kind = 'lumped'\n/\n&rotation\n   speed_rpm = {speed}\n/\n&mass\n   value = 1.0\n/\n"
        )
        samples.dataset(file, "time", time, "s", "time")
        samples.dataset(file, "observable/contact_force.stop", np.maximum(np.sin(turn), 0.0), "N", "stop contact force")
        for name, value in (("rotor.7.v", np.cos(turn)), ("rotor.7.w", np.sin(turn) + 0.1 * np.sin(2 * turn))):
            samples.dataset(file, f"observable/displacement.{name}", 1e-5 * value, "m", f"{LONG}, {name}")
        samples.dataset(file, "rotation/time", np.array([0.0, 1.0]), "s", "time")
        samples.dataset(file, "rotation/speed", np.pi / 30 * np.array([speed, speed + 1200.0]), "rad/s", "speed")
        samples.dataset(file, "outcome/excitation_period", np.array([60.0 / speed]), "s")
        event = np.linspace(0.1, 0.9, 30)
        samples.dataset(file, "event/time", event, "s", "time")
        names = ["stop of the casing", "mesh of the second stage"]
        samples.dataset(file, "event/contact", np.arange(30, dtype=np.int32) % 2 + 1, names=names)
        state = np.array([1, 6, 2, 11, 1, 7], dtype=np.int32)
        samples.dataset(file, "event/state", np.resize(state, 30), meanings=2 * samples.BRANCHES)
    return path


def sweep(path):
    return samples.write_sweep(path, np.linspace(1000.0, 2600.0, 200), {LONG: samples.logistic(200, 40)})


def statistics(path):
    sweep(path)
    with samples.h5py.File(path, "r+") as file:
        for name in ("mesh_of_the_second_stage", "stop_of_the_casing"):
            force = 1e5 * np.linspace(1.0, 2.0, 200)
            samples.dataset(file, f"contact/{name}/largest_force", force, "N", f"{name}: largest force")
    return path


def response(path):
    """Write the responses of three places to two tones, whose peaks lie close beside one another."""
    at = np.linspace(0.0, 2.0, 201)
    samples.write_modes(path)
    with samples.h5py.File(path, "r+") as file:
        omega = 2 * np.pi * file["frequency"][:]
        samples.dataset(file, "eigenvalue", np.stack((-0.03 * omega, omega), axis=-1), "1/s")
        file.attrs["input"] = "&response\n   operating = 1.5, 1.75\n/\n"
        samples.dataset(file, "response/parameter", at, "rpm", "rotation%speed_rpm")
        peaks = []
        for k, name in enumerate(("front_bearing.v", "front_bearing.w", "rear_bearing.v")):
            own = np.array([1.0 + 0.02 * k, 1.03 + 0.02 * k])
            value = 1e-3 / (own**2 - at[:, None] ** 2 + 0.2j * at[:, None])
            parts = np.stack((value.real, value.imag), axis=-1)
            samples.dataset(file, f"response/phasor/displacement.{name}", parts, "m", f"displacement of {name}")
            peaks += [(f"displacement.{name}", tone + 1, own[tone], 5e-3, 5.0) for tone in range(2)]
        columns = ("peak_observable", "peak_tone", "peak_parameter", "peak_amplitude", "amplification_factor")
        for column, values in zip(columns, zip(*peaks, strict=True), strict=True):
            samples.dataset(
                file, f"response/{column}", list(values) if column == "peak_observable" else np.array(values)
            )
    return path


KINDS_OF = {
    "bifurcation": sweep,
    "column": sweep,
    "contacts": statistics,
    "map": samples.write_grid,
    "basins": samples.write_basins,
    "campbell": response,
    "eigenvalues": response,
    "damping": response,
    "bode": response,
    "polar": response,
    "tuning": samples.write_tune,
    "branches": samples.write_follow,
    "curves": lambda path: samples.add_curves(samples.write_follow(path)),
    "sensitivity": lambda path: samples.add_sensitivities(samples.write_follow(path)),
    "work-precision": samples.write_duel,
    "machine": lambda path: samples.write_scene(samples.write_run(path, times=50)),
    "law": lambda path: samples.with_input(samples.write_run(path, times=50), samples.LAWS),
}


@pytest.mark.parametrize("kind", KINDS)
def test_texts_of_a_picture(kind, tmp_path):
    figure = Figure(dpi=100)
    if kind in OVER_MOTIONS:
        results = [open_result(motion(tmp_path / f"{speed}.h5", speed)) for speed in (3000.0, 2400.0, 1800.0)]
        draw_files(results, figure, PlotOptions(observables=("displacement.rotor.7.v",)), kind)
    else:
        options = {"observables": ("events",)} if kind == "column" else {}
        figure = drawn(KINDS_OF.get(kind, motion)(tmp_path / "case.h5"), kind, **options)
    found = boxes(figure)
    assert misplaced(figure, found) == []
    assert not [text for text, _ in found if "\\math" in text]


def test_every_power_and_prefix_of_a_label_is_in_the_fonts(tmp_path):
    powers = "".join(chr(sign) for sign in units.SUPERSCRIPT.values() if isinstance(sign, int))
    labels = [units.scale_for("N/m or N m/rad", 3e6).unit, units.scale_for("", 1e-7).unit, *units.PREFIXES.values()]
    with style.look(), warnings.catch_warnings():
        warnings.simplefilter("error")
        for suffix in ("png", "pdf", "svg"):
            figure = Figure()
            figure.text(0.1, 0.5, powers + " ".join(labels))
            figure.savefig(tmp_path / f"new.{suffix}")


def test_what_is_misplaced_is_found():
    figure = Figure(dpi=100)
    figure.text(0.5, 0.5, "long enough a text", ha="center")
    for x, y, rotation, said in (
        (0.5, 0.51, 0, ["'long enough a text' over 'a'"]),
        (0.5, 0.6, 0, []),
        (0.5, 0.5, 90, ["'long enough a text' over 'a'"]),
        (0.999, 0.2, 0, ["'a' leaves"]),
    ):
        note = figure.text(x, y, "a", rotation=rotation)
        assert misplaced(figure) == said
        note.remove()
    # Boxes of turned texts overlap where the texts do not.
    figure.texts[0].set(rotation=45, text="a long text over a corner of the figure")
    figure.text(0.6, 0.4, "beside it")
    assert misplaced(figure) == []
