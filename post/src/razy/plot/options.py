"""What the user asks of a picture."""

import math
from dataclasses import dataclass, fields
from typing import get_type_hints

import numpy as np
from numpy.typing import NDArray

from razy.arguments import check
from razy.errors import ResultError
from razy.read import SweepResult

QUANTITIES = ("extrema", "largest", "smallest", "multiplier")
# Least and largest width and height, cm, and resolution.
SIZES, RESOLUTIONS = (3.0, 200.0), (30, 2400)


@dataclass(frozen=True)
class PlotOptions:
    """Choices that every kind of picture understands or refuses.

    Attributes
    ----------
    observables, coordinates
        Names to draw; the picture chooses where both are empty.
    start, stop
        Range of the swept parameter (its units) or of time (s), both ends included; open where None.
    title
        Replaces the title of the file; an empty text draws none.
    size
        Width and height in cm; the picture chooses where None.
    footer
        Whether file, version and commit stand in small print below.
    quantity
        What of branches stands on the vertical axis, one of `QUANTITIES`; extrema where None.
    sweep
        A sweep whose points are drawn below branches.
    proved
        Whether each motion of branches is proved, shape (motions,); what is proved has a pale line beneath.
    top
        Highest frequency of a Campbell diagram, of eigenvalues (rad/s) or of spectra; the picture chooses where None.
    period
        Period of a Poincaré section or of the marks of an orbit, s; that of the excitation, or of a revolution, where
        None.
    swap
        Whether the swept parameter stands on the vertical axis of a picture of the kind column.
    point_limit
        Largest number of points of one panel that are drawn one by one; more become a density image.
    """

    observables: tuple[str, ...] = ()
    coordinates: tuple[str, ...] = ()
    start: float | None = None
    stop: float | None = None
    title: str | None = None
    size: tuple[float, float] | None = None
    footer: bool = False
    quantity: str | None = None
    sweep: SweepResult | None = None
    proved: NDArray[np.bool_] | None = None
    top: float | None = None
    period: float | None = None
    swap: bool = False
    point_limit: int = 1_000_000

    def __post_init__(self) -> None:
        check({field.name: getattr(self, field.name) for field in fields(self)}, get_type_hints(PlotOptions))
        if self.size is not None and not all(SIZES[0] <= length <= SIZES[1] for length in self.size):
            raise ResultError(f"size={self.size}: width and height must be {SIZES[0]:g} to {SIZES[1]:g} cm")
        if self.quantity not in (None, *QUANTITIES):
            raise ResultError(f"quantity={self.quantity!r}: one of {', '.join(QUANTITIES)}")
        if self.period is not None and not 0.0 < self.period < math.inf:
            raise ResultError(f"period={self.period}: a time above 0")
        if any(math.isnan(number or 0.0) for number in (self.start, self.stop, self.top)):
            raise ResultError("start, stop, top: numbers, not NaN")

    def range_text(self) -> str:
        """Return the range in words, for messages."""
        if self.start is None and self.stop is None:
            return "in the file"
        if self.start is None:
            return f"up to {self.stop:g}"
        if self.stop is None:
            return f"from {self.start:g} on"
        return f"between {self.start:g} and {self.stop:g}"


class PlotNote(UserWarning):
    """Something about a picture that the user should know, such as what was left out of it."""
