"""Axes that read well: an SI prefix or a power of ten in the label, names made from those of the file."""

import math
import re
import string
import textwrap
from dataclasses import dataclass

from razy.read import Quantity

PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
PREFIXED_UNITS = ("m", "s", "rad", "N", "Pa", "Hz", "W", "J", "V", "A")
NO_LARGE_PREFIX = ("m", "s", "rad")
SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")

# Parameters of the namelist whose names alone do not say what they are.
PARAMETERS = {
    "exciter.frequency": "frequency of the exciter",
    "gear_mesh.backlash": "backlash",
    "load.amplitude": "amplitude of the load",
    "load.frequency": "frequency of the load",
    "load.value": "load",
    "reduction.modes": "modes kept of each part",
    "rotation.speed_rpm": "speed",
    "spring.stiffness": "stiffness of the spring",
    "stop.clearance": "clearance of the stop",
    "stop.restitution": "coefficient of restitution",
    "stop.stiffness": "stiffness of the stop",
}

# Letters on a line of the label of a panel in a column.
LABEL_WIDTH = 26


@dataclass(frozen=True)
class Scale:
    """Values times `factor` are in `unit`, the text for the label; empty for a plain number."""

    factor: float
    unit: str


def scale_for(units: str, largest: float) -> Scale:
    """Choose the unit in which values up to `largest` (absolute, in `units`) read well.

    A unit that starts with a symbol of the SI to the first power has a prefix, any other (m or rad) a power of ten.
    Values between 0.09 and 900 are left alone; else the largest number on the axis becomes about 0.9 to 900.
    """
    unit = pretty(units)
    if not math.isfinite(largest) or largest == 0.0 or 0.09 <= largest < 900.0:
        return Scale(1.0, unit)
    power = 3 * math.floor(math.log10(1.1 * largest) / 3)
    symbol = unit[: len(unit) - len(unit.lstrip(string.ascii_letters))]
    if symbol in PREFIXED_UNITS and " or " not in unit and not unit[len(symbol) :].startswith(tuple("⁻⁰¹²³⁴⁵⁶⁷⁸⁹")):
        highest = 0 if symbol in NO_LARGE_PREFIX else max(PREFIXES)
        power = min(max(power, min(PREFIXES)), highest)
        return Scale(10.0**-power, PREFIXES[power] + unit)
    if -3 <= math.log10(largest) < 5:
        return Scale(1.0, unit)
    return Scale(10.0**-power, f"10{str(power).translate(SUPERSCRIPT)} {unit}".rstrip())


def pretty(units: str) -> str:
    """Return units as they are printed: ``kg*m^2`` becomes ``kg·m²``; ``1`` becomes empty."""
    units = re.sub(r"\^\(?(-?\d+)\)?|\*\*\(?(-?\d+)\)?", lambda m: (m[1] or m[2]).translate(SUPERSCRIPT), units.strip())
    return "" if units in ("1", "-") else units.replace("*", "·")


def per_second(units: str) -> str:
    """Return the units of a rate of change."""
    units = units.strip()
    if units in ("", "1", "-"):
        return "1/s"
    if units.endswith("/s"):
        return f"{units}^2"
    return f"{units}/s" if "/" not in units else f"{units} s^-1"


def readable_name(quantity: Quantity) -> str:
    """Return the long name; where it only repeats a name of the namelist, that name in words.

    ``rotation.speed_rpm`` with units ``rpm`` becomes ``rotation speed``.
    """
    name = quantity.long_name or quantity.name
    if " " in name:
        return name
    name = re.sub(r"\(\d+\)", "", name).replace("%", ".")
    if name in PARAMETERS:
        return PARAMETERS[name]
    words = re.split(r"[.%_]", name)
    if len(words) > 1 and words[-1] == quantity.units:
        words.pop()
    return " ".join(words)


def in_words(name: str) -> str:
    """Return a name of the namelist in words: ``table_pallet_left`` becomes ``table pallet left``."""
    return re.sub(r"[._]+", " ", name)


def axis_label(quantity: Quantity, scale: Scale, width: int | None = None) -> str:
    """Return the text of an axis: name and, in parentheses, unit; on lines of at most `width` letters."""
    name = readable_name(quantity)
    if not scale.unit:
        return name if width is None else textwrap.fill(name, width, break_long_words=False)
    if width is None:
        return f"{name} ({scale.unit})"
    # The unit stays with the word before it.
    tied = f"{name}\N{NO-BREAK SPACE}({scale.unit.replace(' ', chr(0xA0))})"
    return textwrap.fill(tied, width, break_long_words=False).replace("\N{NO-BREAK SPACE}", " ")
