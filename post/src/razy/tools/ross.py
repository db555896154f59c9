"""Rotors of ROSS (Petrobras' ross-rotordynamics): the file that ``Rotor.save`` writes, as a case of razy.

Axes: ROSS' x, y and z (along the shaft) are y, z and x here, so that its kxx acts on v and its kyy on w; its node 0 is
node 1. ROSS' Timoshenko element with Cowper's coefficient is razy's. A tapered element becomes cylinders.
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
from razy.target import check_output
from razy.tools.cli import new_parser, run_command

STEPS = 10
"""Cylinders of a tapered element."""
RPM = 30.0 / math.pi
COEFFICIENTS = ("kxx", "kxy", "kyx", "kyy", "cxx", "cxy", "cyx", "cyy")
UNITS = dict.fromkeys(COEFFICIENTS[:4], "N/m") | dict.fromkeys(COEFFICIENTS[4:], "N s/m")
MASSES = ("mxx", "mxy", "myx", "myy", "mzz")


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
    groups: dict[str, Any] = {"scene": {"kind": "rotor", "title": f"{file.stem} (from ROSS)"}}
    first_node = _add_shaft(groups, file, elements.pop("ShaftElement", []))
    groups["disk"] = [
        {
            "shaft": "rotor",
            "node": first_node(disk),
            "mass": disk["m"],
            "polar_inertia": disk["Ip"],
            "diametral_inertia": disk["Id"],
        }
        for disk in elements.pop("DiskElement", [])
    ]
    groups["bearing"] = []
    tables: dict[Path, str] = {}
    for kind, members in elements.items():
        for bearing in members:
            if "kxx" not in bearing:
                raise ResultError(f"{file}: a {kind}; shaft elements, disks, bearings and seals are taken")
            table = case.with_name(f"{case.stem}_bearing_{len(groups['bearing']) + 1}.csv")
            _add_bearing(groups["bearing"], tables, file, table, bearing, first_node(bearing))
    if tables:
        _add_speeds(groups, file, [item for members in elements.values() for item in members])
    groups["modes"] = {"count": 20}
    for target in tables:
        check_output(target, [file], force)
    written = write_case({name: members for name, members in groups.items() if members}, case, force)
    for target, text in tables.items():
        target.write_text(text, encoding="utf-8")
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
            _check_numbers(file, name, members)
            elements[name.split("_")[0]].append(members)
    if "ShaftElement" not in elements:
        raise ResultError(f"{file}: no ShaftElement: write it by Rotor.save of ROSS")
    return dict(elements)


def _check_numbers(file: Path, name: str, value: Any) -> None:
    """Raise a `ResultError` for a number that no double holds: a case with it would be refused."""
    if isinstance(value, dict | list):
        for item in value.values() if isinstance(value, dict) else value:
            _check_numbers(file, name, item)
    elif isinstance(value, int | float) and not abs(value) <= sys.float_info.max:
        raise ResultError(f"{file}: {excerpt(name)}: {excerpt(str(value))} is beyond what a number can be")


def _add_shaft(groups: dict[str, Any], file: Path, elements: list[dict[str, Any]]):
    """Add the shaft and its sections; return the function that gives the node of an element of ROSS."""
    for element in elements:
        for key in ("axial_force", "torque", "alpha", "beta"):
            if element.get(key):
                raise ResultError(f"{file}: {_tag(element)}: {key} = {element[key]}; only 0 is taken")
        for key in ("rotary_inertia", "gyroscopic"):
            if not element.get(key, True):
                raise ResultError(f"{file}: {_tag(element)}: {key} = false; only true is taken")
        if element.get("shear_effects", True) and element.get("shear_method_calc", "cowper") != "cowper":
            raise ResultError(f"{file}: {_tag(element)}: shear_method_calc; only 'cowper' is taken")
    shear = {element.get("shear_effects", True) for element in elements}
    if len(shear) > 1:
        raise ResultError(f"{file}: shear_effects: the same for all elements of the shaft")
    places: dict[int, list[dict[str, Any]]] = defaultdict(list)
    for element in elements:
        places[element["n"]].append(element)
    if sorted(places) != list(range(len(places))):
        raise ResultError(f"{file}: the elements of the shaft do not follow one another from node 0 on")

    material = _material(elements[0])
    groups["shaft"] = {"name": "rotor", **material, "element": "timoshenko" if shear.pop() else "rayleigh"}
    main, layers, node, first = [], [], 1, {}
    for n in sorted(places):
        first[n] = node
        count = STEPS if any(_tapered(element) for element in places[n]) else 1
        for element in places[n]:
            for step in range(count):
                section = _section(element, step, count, material)
                if element is places[n][0]:
                    main.append(section)
                else:
                    layers.append({**section, "first_node": node + step})
        node += count
    first[len(places)] = node
    groups["section"] = [_together(list(equal)) for _, equal in groupby(main)] + layers

    def node_of(element: dict[str, Any]) -> int:
        if element.get("n_link") is not None:
            raise ResultError(f"{file}: {_tag(element)}: n_link; only bearings on the frame are taken")
        if element.get("n") not in first:
            raise ResultError(f"{file}: {_tag(element)}: n = {element.get('n')} is no node of the shaft")
        return first[element["n"]]

    return node_of


def _tapered(element: dict[str, Any]) -> bool:
    return any(element.get(f"{side}dr") not in (None, element[f"{side}dl"]) for side in "io")


def _material(element: dict[str, Any]) -> dict[str, float]:
    steel = element["material"]
    return {"young_modulus": steel["E"], "shear_modulus": steel["G_s"], "density": steel["rho"]}


def _section(element: dict[str, Any], step: int, count: int, material: dict[str, float]) -> dict[str, Any]:
    """Return one of `count` equal parts of an element, a cylinder with the diameters in its middle."""
    part = (step + 0.5) / count
    left = {side: element[f"{side}dl"] for side in "io"}
    right = {side: left[side] if element.get(f"{side}dr") is None else element[f"{side}dr"] for side in "io"}
    diameter = (
        left if not _tapered(element) else {side: left[side] + part * (right[side] - left[side]) for side in "io"}
    )
    section = {"shaft": "rotor", "length": element["L"] / count, "outer_diameter": diameter["o"]}
    if diameter["i"]:
        section["inner_diameter"] = diameter["i"]
    own = _material(element)
    return section if own == material else section | own


def _together(sections: list[dict[str, Any]]) -> dict[str, Any]:
    """Return equal sections as one with several elements."""
    if len(sections) == 1:
        return sections[0]
    return {**sections[0], "length": len(sections) * sections[0]["length"], "elements": len(sections)}


def _add_bearing(
    groups: list[dict[str, Any]], tables: dict[Path, str], file: Path, table: Path, bearing: dict[str, Any], node: int
) -> None:
    values = {key: _list(bearing.get(key, 0.0)) for key in (*COEFFICIENTS, *MASSES, "kzz", "czz")}
    if any(any(values[key]) for key in MASSES):
        raise ResultError(f"{file}: {_tag(bearing)}: coefficients of mass; only 0 is taken")
    place = {"shaft": "rotor", "node": node}
    speeds = bearing.get("frequency")
    if speeds is None or len(_list(speeds)) < 2:
        matrix, damping = ([values[key][0] for key in keys] for keys in (COEFFICIENTS[:4], COEFFICIENTS[4:]))
        groups.append({**place, "kind": "matrix", "stiffness": matrix, "damping_matrix": damping})
    else:
        rows = zip(_list(speeds), *(values[key] for key in COEFFICIENTS), strict=True)
        header = ", ".join(["speed_rpm", *(f"{key} [{UNITS[key]}]" for key in COEFFICIENTS)])
        lines = [", ".join(repr(float(item)) for item in (speed * RPM, *row)) for speed, *row in rows]
        tables[table] = "\n".join([header, *lines]) + "\n"
        groups.append({**place, "kind": "table", "file": str(table)})
    if any(values["kzz"]) or any(values["czz"]):
        if len(set(values["kzz"])) > 1 or len(set(values["czz"])) > 1:
            raise ResultError(f"{file}: {_tag(bearing)}: kzz and czz over the speed; only constant ones are taken")
        axial = [[values[key][0], *[0.0] * 5] for key in ("kzz", "czz")]
        groups.append({**place, "kind": "matrix", "stiffness": axial[0], "damping_matrix": axial[1]})


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
