"""Rotors of ROSS (Petrobras' ross-rotordynamics): the file that ``Rotor.save`` writes, as a case of razy.

Axes: ROSS' x, y and z (along the shaft) are y, z and x here, so that its kxx acts on v and its kyy on w; its node 0 is
node 1. ROSS' Timoshenko element with Cowper's coefficient is razy's. A tapered element is a cone. Shafts inside
each other, and those on both sides of a coupling, have one speed; a node with nothing but a mass is a housing.
"""

import json
import math
import sys
import tomllib
from collections import defaultdict
from collections.abc import Iterable
from itertools import groupby
from pathlib import Path
from typing import Any

from razy.arguments import checked
from razy.errors import ResultError, excerpt
from razy.programs.case import write_case
from razy.target import check_output, write_text
from razy.tools.cli import new_parser, run_command

RIGID = 1.0e15
"""Stiffness of a bearing, N/m, from which on it is a support."""
RPM = 30.0 / math.pi
COEFFICIENTS = ("kxx", "kxy", "kyx", "kyy", "cxx", "cxy", "cyx", "cyy")
UNITS = dict.fromkeys(COEFFICIENTS[:4], "N/m") | dict.fromkeys(COEFFICIENTS[4:], "N s/m")
MASSES = ("mxx", "mxy", "myx", "myy", "mzz")
COUPLED = ("m_l", "m_r", "Ip_l", "Ip_r", "Id_l", "Id_r")
SIZES = ("L", "idl", "odl", "E", "G_s", "rho", "m", "Ip", "Id", "mx", "my", "mz", *COUPLED)
LARGEST = 1.0e30
"""What razy takes."""
GEARS = "import each shaft of a rotor with gears alone, and join them by &gear_mesh"


@checked
def import_ross(file: str | Path, case: str | Path, force: bool = False) -> Path:
    """Write a rotor of ROSS as a case; return the path of the case.

    Coefficients of bearings and seals over the speed go to tables beside it, ``CASE_bearing_1.csv`` and so on.

    Parameters
    ----------
    file
        File of ``ross.Rotor.save``, .toml or .json.
    case
        File to write.
    force
        Whether to overwrite it and its tables.
    """
    file, case = Path(file), Path(case)
    elements = read_elements(file)
    try:
        return _write(file, case, elements, force)
    except KeyError as missing:
        raise ResultError(f"{file}: an element has no {missing}") from None
    except (TypeError, ValueError, AttributeError) as error:
        raise ResultError(f"{file}: a value of an element is not what Rotor.save writes: {error}") from None


def _write(file: Path, case: Path, elements: dict[str, list[dict[str, Any]]], force: bool) -> Path:
    if "GearElement" in elements:
        raise ResultError(f"{file}: {GEARS}")
    groups: dict[str, Any] = {"scene": {"kind": "rotor", "title": f"{file.stem} (from ROSS)"}}
    places = _add_shafts(groups, file, elements.pop("ShaftElement", []))
    masses = elements.pop("PointMass", [])
    _add_housings(groups, file, places, masses, [item for members in elements.values() for item in members])
    groups["disk"] = [
        _place(file, places, disk) | {"mass": disk["m"], "polar_inertia": disk["Ip"], "diametral_inertia": disk["Id"]}
        for disk in elements.pop("DiskElement", [])
    ]
    groups["disk"] += [
        _place(file, places, mass) | {"mass": _one_mass(file, mass), "polar_inertia": 0.0, "diametral_inertia": 0.0}
        for mass in masses
        if places[mass["n"]]["shaft"] not in {housing["name"] for housing in groups["housing"]}
    ]
    groups["bearing"], groups["support"] = [], []
    for coupling in elements.pop("CouplingElement", []):
        _add_coupling(groups, file, places, coupling)
    tables: dict[Path, str] = {}
    for kind, members in elements.items():
        for bearing in members:
            if "kxx" not in bearing:
                raise ResultError(
                    f"{file}: a {kind}; shaft elements, disks, point masses, couplings, bearings and seals are taken"
                )
            table = case.with_name(f"{case.stem}_bearing_{len(groups['bearing']) + 1}.csv")
            _add_bearing(groups, tables, file, table, bearing, places)
    if tables:
        _add_speeds(groups, file, [item for members in elements.values() for item in members])
    groups["modes"] = {"count": 20}
    for target in tables:
        check_output(target, [file], force)
    written = write_case({name: members for name, members in groups.items() if members}, case, force)
    for target, text in tables.items():
        write_text(target, text)
    return written


def read_elements(file: Path) -> dict[str, list[dict[str, Any]]]:
    """Return the elements of a file of ROSS by their class."""
    try:
        text = file.read_text(encoding="utf-8")
        data = json.loads(text) if file.suffix.lower() == ".json" else tomllib.loads(text)
    except (OSError, ValueError) as error:
        raise ResultError(f"{file}: no .toml or .json file of a rotor of ROSS: {error}") from error
    elements: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for name, members in data.items() if isinstance(data, dict) else ():
        if isinstance(members, dict) and name != "parameters" and not name.startswith("_"):
            _check_values(file, name, "", members)
            elements[name.split("_")[0]].append(members)
    if "ShaftElement" not in elements:
        raise ResultError(f"{file}: no ShaftElement: write it by Rotor.save of ROSS")
    return dict(elements)


def _check_values(file: Path, name: str, key: str, value: Any) -> None:
    """Raise a `ResultError` for a value that no case may have: with it the case would be refused."""
    said = f"{file}: {excerpt(name)}: {excerpt(f'{key} = {value}')}"
    if isinstance(value, dict):
        for inner, item in value.items():
            _check_values(file, name, inner, item)
    elif key in SIZES and (isinstance(value, bool) or not isinstance(value, int | float) or value < 0.0):
        raise ResultError(f"{said}: a number that is not negative is wanted")
    elif key in ("n", "n_link") and not (value is None or isinstance(value, int)):
        raise ResultError(f"{said}: the number of a node is wanted; {GEARS}")
    elif key in (*COEFFICIENTS, *MASSES) and any(isinstance(item, bool | str) for item in _list(value)):
        raise ResultError(f"{said}: numbers are wanted")
    for item in _list(value):
        if isinstance(item, int | float) and not abs(item) <= LARGEST:
            raise ResultError(f"{said} is beyond {LARGEST:.0e}")


def _add_shafts(groups: dict[str, Any], file: Path, elements: list[dict[str, Any]]) -> dict[int, dict[str, Any]]:
    """Add the shafts and their sections; return shaft and node of each node of ROSS."""
    for element in elements:
        if not element.get("gyroscopic", True):
            raise ResultError(f"{file}: {_tag(element)}: gyroscopic = false; only true is taken")
        if element.get("shear_effects", True) and element.get("shear_method_calc", "cowper") != "cowper":
            raise ResultError(f"{file}: {_tag(element)}: shear_method_calc; only 'cowper' is taken")
    at: dict[int, list[dict[str, Any]]] = defaultdict(list)
    for element in elements:
        at[element["n"]].append(element)
    runs: list[list[int]] = []
    for n in sorted(at):
        if runs and n == runs[-1][-1] + 1:
            runs[-1].append(n)
        else:
            runs.append([n])
    groups["shaft"], groups["section"] = [], []
    places: dict[int, dict[str, Any]] = {}
    for number, run in enumerate(runs, 1):
        name = "rotor" if len(runs) == 1 else f"rotor{number}"
        own = [element for n in run for element in at[n]]
        material = _material(own[0])
        shear = _same(file, own, "shear_effects", True)
        shaft = {"name": name, **material, "element": "timoshenko" if shear else "rayleigh"}
        for key, theirs in (("mass_damping", "alpha"), ("stiffness_damping", "beta")):
            if value := _same(file, own, theirs, 0.0):
                shaft[key] = value
        if not _same(file, own, "rotary_inertia", True):
            shaft["rotary_inertia"] = False
        if number > 1:
            shaft["speed_ratio"] = 1.0
        groups["shaft"].append(shaft)
        main, layers, node = [], [], 1
        for n in run:
            places[n] = {"shaft": name, "node": node}
            first, *others = ({"shaft": name, **_section(element, material)} for element in at[n])
            main.append(first)
            layers += [{**section, "first_node": node} for section in others]
            node += 1
        places[run[-1] + 1] = {"shaft": name, "node": node}
        groups["section"] += [one for _, equal in groupby(main) for one in _together(list(equal))] + layers
    return places


def _same(file: Path, elements: list[dict[str, Any]], key: str, default: Any) -> Any:
    """Return what all elements of a shaft have."""
    values = {element.get(key, default) for element in elements}
    if len(values) > 1:
        raise ResultError(f"{file}: {key}: the same for all elements of the shaft")
    return values.pop()


def _add_housings(
    groups: dict[str, Any],
    file: Path,
    places: dict[int, dict[str, Any]],
    masses: list[dict[str, Any]],
    bearings: list[dict[str, Any]],
) -> None:
    """Add a housing for each node that bearings link to and that is on no shaft, with its mass."""
    groups["housing"] = []
    for n in sorted({bearing["n_link"] for bearing in bearings if bearing.get("n_link") is not None} - set(places)):
        own = [_one_mass(file, mass) for mass in masses if mass["n"] == n]
        if not own:
            raise ResultError(f"{file}: node {n} has no mass; give it a PointMass")
        groups["housing"].append({"name": f"node{n}", "mass": sum(own)})
        places[n] = {"shaft": f"node{n}", "node": 1}


def _one_mass(file: Path, mass: dict[str, Any]) -> float:
    """Return the mass of a point mass, which is the same in all directions; ROSS 1 has none along the shaft."""
    if len({mass["mx"], mass["my"], mass.get("mz", mass["mx"])}) > 1:
        raise ResultError(f"{file}: {_tag(mass)}: mx, my and mz; only equal ones are taken")
    return mass["mx"]


def _place(file: Path, places: dict[int, dict[str, Any]], element: dict[str, Any], key: str = "n") -> dict[str, Any]:
    if element.get(key) not in places:
        raise ResultError(f"{file}: {_tag(element)}: {key} = {element.get(key)} is no node of a shaft")
    return dict(places[element[key]])


def _add_coupling(
    groups: dict[str, Any], file: Path, places: dict[int, dict[str, Any]], coupling: dict[str, Any]
) -> None:
    """Add a coupling between the node before and the node behind it: its halves are disks."""
    ends = _place(file, places, coupling), _place(file, places, {**coupling, "n": coupling["n"] + 1})
    for end, side in zip(ends, "lr", strict=True):
        inertia = {"polar_inertia": coupling[f"Ip_{side}"], "diametral_inertia": coupling[f"Id_{side}"]}
        groups["disk"].append({**end, "mass": coupling[f"m_{side}"], **inertia})
    matrices = ([coupling[f"{what}{way}_{axis}"] for way in "tr" for axis in "zxy"] for what in "kc")
    stiffness, damping = matrices
    to = f"{ends[1]['shaft']}.{ends[1]['node']}"
    groups["bearing"].append({**ends[0], "to": to, "kind": "matrix", "stiffness": stiffness, "damping_matrix": damping})


def _material(element: dict[str, Any]) -> dict[str, float]:
    steel = element["material"]
    return {"young_modulus": steel["E"], "shear_modulus": steel["G_s"], "density": steel["rho"]}


def _section(element: dict[str, Any], material: dict[str, float]) -> dict[str, Any]:
    """Return an element as a cylinder or cone."""
    section = {"length": element["L"], "outer_diameter": element["odl"]}
    if element["idl"]:
        section["inner_diameter"] = element["idl"]
    for side, word in (("o", "outer"), ("i", "inner")):
        if element.get(f"{side}dr") not in (None, element[f"{side}dl"]):
            section[f"{word}_diameter_end"] = element[f"{side}dr"]
    if element.get("axial_force"):
        section["axial_force"] = element["axial_force"] + 0.0
    if element.get("torque"):
        section |= {"torque": element["torque"] + 0.0, "torque_axis": "fixed"}
    own = _material(element)
    return section if own == material else section | own


def _together(sections: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return equal cylinders as one with several elements, and cones as they are."""
    first, count = sections[0], len(sections)
    if count == 1 or any(key.endswith("_end") for key in first):
        return sections
    return [{**first, "length": count * first["length"], "elements": count}]


def _add_bearing(
    groups: dict[str, Any],
    tables: dict[Path, str],
    file: Path,
    table: Path,
    bearing: dict[str, Any],
    places: dict[int, dict[str, Any]],
) -> None:
    values = {key: _list(bearing.get(key, 0.0)) for key in (*COEFFICIENTS, *MASSES, "kzz", "czz")}
    place = _place(file, places, bearing)
    linked = {}
    if bearing.get("n_link") is not None:
        to = _place(file, places, bearing, "n_link")
        linked = {"to": f"{to['shaft']}.{to['node']}"}
    _add_mass(groups, file, bearing, place, values)
    held = [way for way, key in (("v", "kxx"), ("w", "kyy"), ("u", "kzz")) if min(values[key]) >= RIGID]
    if held and not linked:
        groups["support"].append({**place, "held": held})
        for key in values:
            if any(axis in key[1:] for way, axis in zip("vwu", "xyz", strict=True) if way in held):
                values[key] = [0.0] * len(values[key])
    speeds = bearing.get("frequency")
    if speeds is None or len(_list(speeds)) < 2:
        matrix, damping = ([values[key][0] for key in keys] for keys in (COEFFICIENTS[:4], COEFFICIENTS[4:]))
        if any(matrix) or any(damping):
            own = {"kind": "matrix", "stiffness": matrix, "damping_matrix": damping}
            groups["bearing"].append({**place, **linked, **own})
    elif linked:
        raise ResultError(
            f"{file}: {_tag(bearing)}: n_link with coefficients over the speed; only constant ones are taken"
        )
    else:
        rows = zip(_list(speeds), *(values[key] for key in COEFFICIENTS), strict=True)
        header = ", ".join(["speed_rpm", *(f"{key} [{UNITS[key]}]" for key in COEFFICIENTS)])
        lines = [", ".join(repr(float(item)) for item in (speed * RPM, *row)) for speed, *row in rows]
        tables[table] = "\n".join([header, *lines]) + "\n"
        groups["bearing"].append({**place, "kind": "table", "file": str(table)})
    if any(values["kzz"]) or any(values["czz"]):
        if len(set(values["kzz"])) > 1 or len(set(values["czz"])) > 1:
            raise ResultError(f"{file}: {_tag(bearing)}: kzz and czz over the speed; only constant ones are taken")
        axial = [[values[key][0], *[0.0] * 5] for key in ("kzz", "czz")]
        own = {"kind": "matrix", "stiffness": axial[0], "damping_matrix": axial[1]}
        groups["bearing"].append({**place, **linked, **own})


def _add_mass(
    groups: dict[str, Any], file: Path, bearing: dict[str, Any], place: dict[str, Any], values: dict[str, list[float]]
) -> None:
    """Add the mass of a bearing across the shaft as a disk without inertia, which moves along the shaft too."""
    if not any(any(values[key]) for key in MASSES):
        return
    one = values["mxx"][0]
    even = all(value == one for key in ("mxx", "myy") for value in values[key])
    if not even or any(values["mxy"]) or any(values["myx"]) or any(value not in (0.0, one) for value in values["mzz"]):
        raise ResultError(f"{file}: {_tag(bearing)}: coefficients of mass; only one mass, mxx = myy, is taken")
    if bearing.get("n_link") is not None:
        raise ResultError(f"{file}: {_tag(bearing)}: coefficients of mass with n_link")
    groups["disk"].append({**place, "mass": one, "polar_inertia": 0.0, "diametral_inertia": 0.0})


def _add_speeds(groups: dict[str, Any], file: Path, bearings: Iterable[dict[str, Any]]) -> None:
    """Add the speeds that all tables have."""
    ranges = [_list(item["frequency"]) for item in bearings if len(_list(item.get("frequency") or [])) > 1]
    low, high = (pick(ends) for pick, ends in ((max, [r[0] for r in ranges]), (min, [r[-1] for r in ranges])))
    if not high > low:
        raise ResultError(f"{file}: no speed that the tables of all bearings have")
    # A hair inside: the tables are in rpm, rounded.
    low, high = low * RPM * (1 + 1e-12), high * RPM * (1 - 1e-12)
    groups["rotation"] = {"speed_rpm": low}
    groups["campbell"] = {"first_rpm": low, "last_rpm": high, "points": 41, "damped": True}


def _list(value: Any) -> list[float]:
    return list(value) if isinstance(value, list | tuple) else [value]


def _tag(element: dict[str, Any]) -> str:
    return excerpt(str(element.get("tag", "an element")))


def main(arguments: list[str] | None = None) -> int:
    """Run ``razy-import-ross``; return its exit code."""
    parser = new_parser("razy-import-ross", "Write a rotor of ROSS as a case of razy.")
    parser.add_argument("file", metavar="FILE", type=Path, help="file of Rotor.save of ROSS, .toml or .json")
    parser.add_argument("--output", metavar="CASE.nml", type=Path, help="file to write (default: FILE.nml)")
    given = parser.parse_args(arguments)
    target = given.output or Path(given.file.with_suffix(".nml").name)
    return run_command(parser.prog, lambda: str(import_ross(given.file, target, given.force)))


if __name__ == "__main__":
    sys.exit(main())
