"""A machine as linear pieces X' = G X over the phase of the excitation, X = (y, y', 1, cos t, sin t, cos 2t, ...).

y are the coordinates that are felt, ' the derivative by the phase t = Omega*time, so the period is 2 pi k exactly.
"""

from dataclasses import dataclass
from functools import cached_property

from flint import arb, arb_mat, fmpq, fmpq_mat

from razy.check.machine import Contact, Machine, NotCovered, Tone, balls, common, felt, matrix, value_of

ORDER = 24
"""Terms of a Taylor polynomial."""


@dataclass
class Guard:
    """A linear form on X that is positive as long as a branch lasts, and the branch after it."""

    contact: int
    row: arb_mat
    target: str
    bound: str
    """What it is the bound of: a guard of the same bound is zero after the event."""


class System:
    """The pieces of a machine."""

    def __init__(self, machine: Machine, phase: float = 0.0):
        """Reduce the machine to what is felt, exactly, and lay out X; motions begin at this part of the period."""
        self.machine, self.begin = machine, 2 * arb.pi() * phase
        rows = felt(machine)
        self.m, n = rows.nrows(), rows.ncols()
        tones = [tone for _, tone in machine.loads] + [tone for c in machine.contacts for tone in c.tones]
        self.base = common([tone.frequency for tone in tones])
        self.omega = value_of(self.base)
        self.harmonics = sorted({int(tone.frequency[0] / self.base[0]) for tone in tones})
        self.size = 2 * self.m + 1 + 2 * len(self.harmonics)
        right = rows.transpose() * (rows * rows.transpose()).inv()
        inverse = fmpq_mat(n, n, [fmpq(0)] * n * n)
        for i, mass in enumerate(machine.mass):
            inverse[i, i] = fmpq(mass.denominator, mass.numerator)
        self.rows, self.right = rows, right
        stiffness = balls(rows * inverse * matrix(machine.stiffness) * right)
        damping = balls(rows * inverse * matrix(machine.damping) * right)
        force = balls(rows * inverse)
        constant = balls(rows * inverse * matrix([[x] for x in machine.constant]))
        m, w2 = self.m, self.omega**2
        g = arb_mat(self.size, self.size)
        for i in range(m):
            g[i, m + i] = arb(1)
            for j in range(m):
                g[m + i, j] = -stiffness[i, j] / w2
                g[m + i, m + j] = -damping[i, j] / self.omega
            g[m + i, 2 * m] = constant[i, 0] / w2
            for body, tone in machine.loads:
                c = self.column(tone)
                g[m + i, c] += force[i, body] * tone.cosine / w2
                g[m + i, c + 1] += force[i, body] * tone.sine / w2
        for i, k in enumerate(self.harmonics):
            c = 2 * m + 1 + 2 * i
            g[c, c + 1], g[c + 1, c] = arb(-k), arb(k)
        self.free = g
        self.gap, self.rate, self.push = [], [], []
        for contact in machine.contacts:
            w = matrix([contact.w])
            gap = arb_mat(1, self.size)
            on_y = balls(w * right)
            for j in range(m):
                gap[0, j] = on_y[0, j]
            for tone in contact.tones:
                c = self.column(tone)
                gap[0, c] += tone.cosine
                gap[0, c + 1] += tone.sine
            push = arb_mat(self.size, 1)
            on_rows = balls(rows * inverse * w.transpose())
            for i in range(m):
                push[m + i, 0] = on_rows[i, 0]
            self.gap.append(gap)
            self.rate.append(gap * g)
            self.push.append(push)
        self.unit = arb_mat(1, self.size)
        self.unit[0, 2 * m] = arb(1)
        self.generators: dict[tuple[str, ...], arb_mat] = {}

    def column(self, tone: Tone) -> int:
        """Return where the cosine of a tone stands in X."""
        return 2 * self.m + 1 + 2 * self.harmonics.index(int(tone.frequency[0] / self.base[0]))

    def state(self, y: list[arb]) -> arb_mat:
        """Return X at the beginning of the motion."""
        x = arb_mat(self.size, 1)
        for i, value in enumerate(y):
            x[i, 0] = value
        x[2 * self.m, 0] = arb(1)
        for i, k in enumerate(self.harmonics):
            x[2 * self.m + 1 + 2 * i, 0] = (k * self.begin).cos()
            x[2 * self.m + 2 + 2 * i, 0] = (k * self.begin).sin()
        return x

    @cached_property
    def to_felt(self) -> arb_mat:
        """Return the matrix from displacements to y."""
        return balls(self.rows)

    def force(self, contact: int, branch: str) -> arb_mat:
        """Return the form of the force k (s - edge) + b s' of a closed contact, positive upwards in s."""
        c = self.machine.contacts[contact]
        edge, jump = (c.upper, c.offset) if branch.startswith("upper") else (c.lower, -c.offset)
        number = jump - c.stiffness * edge
        stiffness, damping, constant = (arb(fmpq(x.numerator, x.denominator)) for x in (c.stiffness, c.damping, number))
        return self.gap[contact] * stiffness + self.rate[contact] * (damping * self.omega) + self.unit * constant

    def generator(self, mode: tuple[str, ...]) -> arb_mat:
        """Return G of a mode."""
        if mode not in self.generators:
            g = self.free
            for i, branch in enumerate(mode):
                if branch in ("upper", "lower"):
                    g = g - self.push[i] * self.force(i, branch) * (1 / self.omega**2)
            self.generators[mode] = g
        return self.generators[mode]

    def over(self, contact: int, side: str) -> arb_mat:
        """Return the form of the deformation of a side, positive when it is pressed."""
        c: Contact = self.machine.contacts[contact]
        edge = c.upper if side == "upper" else c.lower
        form = self.gap[contact] - self.unit * arb(fmpq(edge.numerator, edge.denominator))
        return form if side == "upper" else -1 * form

    def guards(self, mode: tuple[str, ...]) -> list[Guard]:
        """Return the guards of a mode."""
        result = []
        for i, branch in enumerate(mode):
            c = self.machine.contacts[i]
            if branch == "open":
                target = "impact" if c.restitution is not None else ""
                sides = [side for side, edge in (("upper", c.upper), ("lower", c.lower)) if edge is not None]
                result += [Guard(i, -1 * self.over(i, side), target or side, side) for side in sides]
                continue
            side = branch.split()[0]
            outward = self.force(i, side) if side == "upper" else -1 * self.force(i, side)
            if branch.endswith("parting"):
                result += [Guard(i, -1 * outward, side, "force"), Guard(i, self.over(i, side), "open", side)]
            elif c.zero_force:
                result.append(Guard(i, outward, f"{side} parting", "force"))
            else:
                result.append(Guard(i, self.over(i, side), self.beyond(c, side), side))
        return result

    @staticmethod
    def beyond(contact: Contact, side: str) -> str:
        """Return the branch after a side is left at zero deformation."""
        if contact.upper is not None and contact.upper == contact.lower:
            return "lower" if side == "upper" else "upper"
        return "open"

    def mode_at(self, x: arb_mat) -> tuple[str, ...]:
        """Return the mode at the beginning of the motion, where it is beyond doubt."""
        mode = []
        for i, c in enumerate(self.machine.contacts):
            branch = "open"
            for side, edge in (("upper", c.upper), ("lower", c.lower)):
                if edge is None:
                    continue
                over = (self.over(i, side) * x)[0, 0]
                if over > 0:
                    if c.restitution is not None:
                        raise ValueError(f"the motion lies beyond the rigid stop {c.name} where it begins")
                    branch = side
                    outward = (self.force(i, side) * x)[0, 0] * (1 if side == "upper" else -1)
                    if c.zero_force and not outward > 0:
                        branch = f"{side} parting"
                elif not over < 0:
                    raise NotCovered(f"the bound of {c.name} is touched where the motion begins")
            mode.append(branch)
        return tuple(mode)

    def impact(self, contact: int) -> arb_mat:
        """Return X+ = J X-: the velocity over the gap is reversed by the restitution."""
        c = self.machine.contacts[contact]
        e = c.restitution
        share = (self.gap[contact] * self._on_displacements(self.push[contact]))[0, 0]
        jump = self.push[contact] * self.rate[contact] * (-(1 + arb(fmpq(e.numerator, e.denominator))) / share)
        for i in range(self.size):
            jump[i, i] += 1
        return jump

    def _on_displacements(self, push: arb_mat) -> arb_mat:
        moved = arb_mat(self.size, 1)
        for i in range(self.m):
            moved[i, 0] = push[self.m + i, 0]
        return moved

    def taylor(self, mode: tuple[str, ...], x: arb_mat, order: int = ORDER) -> list[arb_mat]:
        """Return G^k X/k! for k = 0 to order."""
        g = self.generator(mode)
        terms = [x]
        for k in range(1, order + 1):
            terms.append(g * terms[-1] * (arb(1) / k))
        return terms
