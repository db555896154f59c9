"""Numbers and matrices of balls with their derivative by the parameter, and a machine as a function of it."""

from dataclasses import dataclass, fields, is_dataclass, replace
from fractions import Fraction
from typing import Any

from flint import arb

from razy.check.machine import Machine, NotCovered, ball, build, put


@dataclass
class Dual:
    """A number or matrix over a range of the parameter, and its derivative; what is none has the derivative zero."""

    value: Any
    slope: Any

    def __add__(self, other: Any) -> "Dual":
        other = other if isinstance(other, Dual) else Dual(other, 0 * other)
        return Dual(self.value + other.value, self.slope + other.slope)

    def __sub__(self, other: Any) -> "Dual":
        return self + -1 * other

    def __mul__(self, other: Any) -> "Dual":
        if not isinstance(other, Dual):
            return Dual(self.value * other, self.slope * other)
        return Dual(self.value * other.value, self.slope * other.value + self.value * other.slope)

    def __rmul__(self, other: Any) -> "Dual":
        return Dual(other * self.value, other * self.slope)

    def __getitem__(self, at: tuple[int, int]) -> "Dual":
        return Dual(self.value[at], self.slope[at])

    def __setitem__(self, at: tuple[int, int], number: Any) -> None:
        self.value[at], self.slope[at] = (number.value, number.slope) if isinstance(number, Dual) else (number, 0)


def inverse(number: Any) -> Any:
    """Return 1/x of a ball or dual."""
    return Dual(1 / number.value, -number.slope / number.value**2) if isinstance(number, Dual) else 1 / number


def between(values: list[Any], beyond: arb | None = None, slopes: bool = False) -> Any:
    """Return a machine, or a part of it, with balls or duals in the place of its numbers.

    values: one; or those at the first value of the parameter, and one and two units beyond it, if no number is of more
    than second degree.
    """
    first = values[0]
    if isinstance(first, list | tuple):
        return type(first)(between(list(each), beyond, slopes) for each in zip(*values, strict=True))
    if is_dataclass(first):
        parts = {f.name: between([getattr(v, f.name) for v in values], beyond, slopes) for f in fields(first)}
        return replace(first, **parts)
    if not isinstance(first, Fraction | arb):
        return first
    one, *others = (x if isinstance(x, arb) else ball(x) for x in values)
    if all(x == one for x in others):
        return one
    by, bend = others[0] - one, others[1] - 2 * others[0] + one
    value = one + beyond * by + beyond * (beyond - 1) / 2 * bend
    return Dual(value, by + (beyond - arb(1) / 2) * bend) if slopes else value


def family(groups: dict[str, list[dict[str, Any]]], parameter: str, value: float) -> list[Machine]:
    """Return the machines at a value of the parameter and one and two units beyond it."""
    key = parameter.lower().split("%")[-1]
    if "phase" in key or key.startswith(("radius", "teeth", "restitution", "displacement", "force_frequency")):
        raise NotCovered(f"special points over {key}")
    machines = []
    for step in range(3):
        put(groups, parameter, Fraction(value) + step)
        machines.append(build(groups))
    put(groups, parameter, value)
    if any(_shape(machine) != _shape(machines[0]) for machine in machines):
        raise NotCovered("special points where the parameter changes the structure")
    return machines


def _shape(machine: Machine) -> tuple:
    """Return what the parameter must leave as it is."""
    contacts = [
        (c.w, [(p.low is None, p.high is None, p.parts) for p in c.lines], len(c.tones), c.static == c.kinetic)
        for c in machine.contacts
    ]
    frequencies = machine.frequencies()
    waves = [(w, wave.pieces, wave.half_sine) for w, _, wave in machine.waves]
    ratios = [(value / frequencies[0][0], power) for value, power in frequencies]
    return contacts, [w for w, _ in machine.loads], waves, ratios
