"""Files of ``razy-duel``: one motion by several methods, a row for each method and setting."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from razy.read.file import ResultFile, text


@dataclass(frozen=True)
class Series:
    """The rows of one ``&duel``: a method with several settings; all arrays have shape (rows,).

    Attributes
    ----------
    name
        Method and treatment, such as ``dop853, event``, and the sharpness of smoothing if there is one.
    setting
        Relative tolerances, or steps in s if `is_step`.
    error, event_time_error
        Of the displacements, relative; of the times of matched events, s; NaN where the motion ended early.
    cpu_time, rhs_evaluations, event_surplus, status
        Cost in s and right-hand sides; events more than the reference has; 0 where the motion was completed.
    """

    name: str
    is_step: bool
    setting: NDArray[np.float64]
    error: NDArray[np.float64]
    event_time_error: NDArray[np.float64]
    cpu_time: NDArray[np.float64]
    rhs_evaluations: NDArray[np.int64]
    event_surplus: NDArray[np.int64]
    status: NDArray[np.int64]


class DuelResult(ResultFile):
    """Result of a duel."""

    @property
    def reference(self) -> str:
        """What the rows were compared with."""
        return text(self._dataset("reference/error").attrs.get("reference", ""))

    @property
    def reference_error(self) -> float:
        """Difference between the reference and its check, relative as `Series.error`."""
        return float(self._vector("reference/error", 1)[0])

    @property
    def series(self) -> list[Series]:
        """The series in the order of the input."""
        number = np.asarray(self._vector("series")[()])
        method = [text(item) for item in self._vector("method", number.size)[()]]
        treatment = [text(item) for item in self._vector("treatment", number.size)[()]]
        found = []
        for one in np.unique(number):
            rows = np.flatnonzero(number == one)
            name = method[rows[0]] if method[rows[0]] == "exact" else f"{method[rows[0]]}, {treatment[rows[0]]}"
            sharpness = np.unique(np.asarray(self._vector("sharpness", number.size)[()])[rows])
            if sharpness.size == 1 and sharpness[0] > 0:
                name += f" {sharpness[0]:g}"
            found.append(
                Series(
                    name,
                    bool(self._vector("setting_is_step")[rows[0]]),
                    *(
                        np.asarray(self._vector(column, number.size)[()])[rows]
                        for column in (
                            "setting",
                            "error",
                            "event_time_error",
                            "cpu_time",
                            "rhs_evaluations",
                            "event_surplus",
                            "status",
                        )
                    ),
                )
            )
        return found
