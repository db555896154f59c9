"""Numbers and matrices of balls with their derivative by the parameter, and a machine as a function of it."""

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from flint import arb, arb_mat, fmpq

from razy.check.machine import Machine, NotCovered, build, put


@dataclass
class Dual:
    """A number or matrix over a range of the parameter, and its derivative."""

    value: Any
    slope: Any

    def __add__(self, other: Any) -> "Dual":
        other = other if _dual(other) else Dual(other, 0 * other)
        return Dual(self.value + other.value, self.slope + other.slope)

    def __sub__(self, other: Any) -> "Dual":
        return self + -1 * other

    def __mul__(self, other: Any) -> "Dual":
        if not _dual(other):
            return Dual(self.value * other, self.slope * other)
        return Dual(self.value * other.value, self.slope * other.value + self.value * other.slope)

    def __rmul__(self, other: Any) -> "Dual":
        return Dual(other * self.value, other * self.slope)

    def inverse(self) -> "Dual":
        """Return 1/x of a number."""
        return Dual(1 / self.value, -self.slope / self.value**2)

    def __getitem__(self, at: tuple[int, int]) -> "Dual":
        return Dual(self.value[at], self.slope[at])

    def __setitem__(self, at: tuple[int, int], number: Any) -> None:
        self.value[at], self.slope[at] = (number.value, number.slope) if _dual(number) else (number, 0)


def _dual(x: Any) -> bool:
    return isinstance(x, Dual)


class Numbers:
    """Takes numbers of a machine, of which each is of at most second degree in the parameter, as balls or duals.

    machines: at the first value of the parameter, and one and two units beyond it; or one, which no parameter changes.
    """

    def __init__(self, machines: list[Machine], beyond: arb | None = None, slopes: bool = False):
        """Take values at `beyond` from the first value of the parameter."""
        self.machines, self.beyond, self.slopes = machines, beyond, slopes
        if slopes and len(machines) < 3:
            raise ValueError("derivatives need three machines")

    def __call__(self, get: Callable[[Machine], Fraction | arb]) -> Any:
        """Return a number."""
        values = [_ball(get(machine)) for machine in self.machines]
        if len(values) == 1:
            return values[0]
        first, second = values[1] - values[0], values[2] - 2 * values[1] + values[0]
        t = self.beyond
        value = values[0] + t * first + t * (t - 1) / 2 * second
        return Dual(value, first + (t - arb(1) / 2) * second) if self.slopes else value

    def matrix(self, get: Callable[[Machine], list[list[Fraction]]]) -> Any:
        """Return a matrix."""
        rows = [get(machine) for machine in self.machines]
        result = self.zeros(len(rows[0]), len(rows[0][0]))
        for i in range(len(rows[0])):
            for j in range(len(rows[0][0])):
                result[i, j] = self(lambda machine, i=i, j=j: get(machine)[i][j])
        return result

    def zeros(self, rows: int, columns: int) -> Any:
        """Return a matrix of zeros."""
        return Dual(arb_mat(rows, columns), arb_mat(rows, columns)) if self.slopes else arb_mat(rows, columns)


def inverse(number: Any) -> Any:
    """Return 1/x of a ball or dual."""
    return number.inverse() if isinstance(number, Dual) else 1 / number


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
    if len({_shape(machine) for machine in machines}) > 1:
        raise NotCovered("special points where the parameter changes the structure")
    return machines


def _ball(x: Fraction | arb) -> arb:
    return x if isinstance(x, arb) else arb(fmpq(x.numerator, x.denominator))


def _shape(machine: Machine) -> tuple:
    """Return what the parameter must leave as it is."""
    contacts = tuple(
        (tuple(c.w), c.upper is None, c.lower is None, c.zero_force, len(c.tones), len(c.lines), c.static == c.kinetic)
        for c in machine.contacts
    )
    frequencies = machine.frequencies()
    waves = tuple((tuple(w), tuple(wave.pieces), wave.half_sine) for w, _, wave in machine.waves)
    return (
        contacts,
        tuple(tuple(w) for w, _ in machine.loads),
        waves,
        tuple((value / frequencies[0][0], power) for value, power in frequencies),
    )
