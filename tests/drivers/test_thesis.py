"""The inputs of the source's figures and tables hold to its captions: load, contact, matrices, number."""

import f90nml
import pytest
from programs import SOURCE, succeed

FOLDER = SOURCE / "inputs/thesis"

# Torque in N m of each gear pair, whether the circulatory matrix acts, and the program, by the captions.
GEARBOX = {
    "4_13": (None, True, "modes"), "4_14": (None, False, "modes"), "4_15": (150, False, "sweep"),
    "4_16": (150, False, "run"), "4_17": (50, False, "sweep"), "4_18": (50, False, "sweep"),
    "4_19": (50, False, "sweep"), "4_20": (50, False, "sweep"), "4_21": (150, False, "sweep"),
    "4_22": (150, False, "sweep"), "a_2": (150, True, "sweep"), "a_3": (200, False, "sweep"),
    "a_4": (500, False, "sweep"), "a_5": (10, False, "sweep"),
}  # fmt: skip
TORSIONAL = {"4_3": 100, "4_4": 100, "4_5": 200, "4_6": 50, "4_7": 100}
# Side of the stop, damping of the stop, damping of the spring as a factor of its stiffness.
STOPS = {
    "2_5": ("both", None, None), "2_5_damped": ("both", 100.0, 1e-4),
    "2_6": ("upper", None, None), "2_6_damped": ("upper", 100.0, 1e-4),
}  # fmt: skip
LAWS = {"2_7_a": "kelvin_voigt", "2_7_b": "hunt_crossley", "2_7_c": "hertz"}
SWEEPS = ("fig_2_2", "fig_2_2_drop", "fig_4_3", "fig_4_5", "fig_4_6", "fig_4_7", "fig_4_30")
OTHERS = {
    "fig_4_26": "tune",
    "shaft_4_3": "modes",
    "table_4_1": "duel",
    "table_4_2": "modes",
    "table_4_3": "modes",
    "listing_duel": "duel",
}


def read(name):
    return f90nml.read(FOLDER / f"{name}.nml")


def program_of(name):
    number = name.removeprefix("fig_")
    if number in GEARBOX:
        return GEARBOX[number][2]
    return "sweep" if name in SWEEPS else OTHERS.get(name, "run")


@pytest.mark.parametrize("name", sorted(path.stem for path in FOLDER.glob("*.nml")))
def test_input_is_accepted_and_has_its_number(name):
    succeed(f"razy-{program_of(name)}", FOLDER / f"{name}.nml", "--check")
    kind, *number = name.split("_")
    if kind in ("fig", "table"):
        words = f"{'Figure' if kind == 'fig' else 'Table'} {number[0].upper()}.{number[1]}"
        assert (FOLDER / f"{name}.nml").read_text().startswith(f"! {words}")
        assert words in read(name)["scene"]["title"]


@pytest.mark.parametrize("number", GEARBOX)
def test_gearbox_has_torque_and_circulation_of_the_caption(number):
    torque, circulatory, program = GEARBOX[number]
    case = read(f"fig_{number}")
    assert case["rotation"]["circulatory"] is circulatory
    assert case["rotation"]["gyroscopic"] is True
    if torque is None:
        assert "load" not in case
        assert case["modes"]["count"] == 20
    else:
        assert [load["value"] for load in case["load"]] == [torque, torque]
        assert case["gear_mesh"]["backlash"] == 4e-5
    assert (program == "sweep") == ("sweep" in case)


def test_reductions_are_those_of_the_captions():
    for number, level in (("4_21", "a"), ("4_22", "b")):
        reduction = read(f"fig_{number}")["reduction"]
        assert (reduction["modes"], reduction["level"], reduction["kept"]) == (40, level, 40)
    table = read("table_4_2")
    assert (table["reduction"]["modes"], table["modes"]["count"], table["modes"]["contacts"]) == (40, 80, "open")


def test_time_is_measured_as_the_source_does():
    case = read("fig_4_18")
    assert case["motion"]["t_end"] == 0.05
    assert case["motion"]["integrator"] == "dormand_prince"
    assert read("fig_4_20")["rotation"]["speed_rpm"] == 3000
    assert read("fig_4_20")["sweep"]["parameter"] == "reduction%modes"


@pytest.mark.parametrize("number", TORSIONAL)
def test_torsional_gear_pair_has_the_torque_of_the_caption(number):
    assert [load["value"] for load in read(f"fig_{number}")["load"]] == [TORSIONAL[number], -TORSIONAL[number]]


@pytest.mark.parametrize("number", STOPS)
def test_stops_have_sides_and_damping_of_the_caption(number):
    case = read(f"fig_{number}")
    stop, spring = case["stop"], case["spring"]
    assert (stop["side"], stop.get("damping"), spring.get("damping_factor")) == STOPS[number]


@pytest.mark.parametrize("number", LAWS)
def test_laws_are_those_of_the_caption(number):
    stop = read(f"fig_{number}")["stop"]
    assert stop["law"] == LAWS[number]


def test_systems_of_table_3_1_are_those_of_its_rows():
    stop, friction, impact = (read(f"table_3_1_{row}") for row in "abc")
    assert (stop["stop"]["side"], stop["stop"]["clearance"]) == ("upper", 0.0)
    assert "stop" not in friction
    assert "kinetic_coefficient" not in friction["friction"]
    assert (impact["stop"]["law"], impact["stop"]["side"], impact["stop"]["clearance"]) == ("rigid", "lower", 0.0)
    assert impact["load"]["value"] == -9.81 * impact["mass"]["value"]
    assert all(system["spring"]["stiffness"] > 0.0 for system in (stop, friction))


def test_laws_of_figure_3_2_are_rigid_contact_and_dry_friction():
    assert read("fig_3_2")["stop"]["law"] == "rigid"
    assert "friction" not in read("fig_3_2")
    assert "stop" not in read("fig_3_2_friction")
    assert "kinetic_coefficient" not in read("fig_3_2_friction")["friction"]


def test_contact_of_figure_3_5_is_at_the_origin_with_viscous_and_with_dry_friction():
    for name in ("fig_3_5", "fig_3_5_friction"):
        assert read(name)["stop"]["clearance"] == 0.0
    assert "friction" not in read("fig_3_5")
    assert read("fig_3_5_friction")["friction"]["only_with"] == "stop"
