"""Real and imaginary parts of the eigenvalues over the angular speed."""

import numpy as np
from matplotlib.figure import Figure

from razy.errors import ResultError
from razy.plot import style
from razy.plot.options import PlotOptions
from razy.read import ModesResult


def draw(result: ModesResult, figure: Figure, options: PlotOptions) -> None:
    """Draw the real parts above, the imaginary parts with the lines of excitation below."""
    if options.observables or options.coordinates:
        raise ResultError(f"{result.path}: a file of razy-modes holds no observables")
    if not result.is_campbell:
        raise ResultError(f"{result.path}: has no eigenvalues over the speed (&campbell)")
    style.set_size(figure, options, 16.0, 13.0)
    upper, lower = figure.subplots(2, 1, sharex=True)
    speed, eigenvalue = result.speed, result.eigenvalue
    for number in np.unique(result.branch[np.isfinite(result.branch)]):
        rows, places = np.nonzero(result.branch == number)
        values = eigenvalue[rows, places]
        upper.plot(speed[rows], values.real, color=style.BLACK, label=f"branch {number:.0f}")
        lower.plot(speed[rows], values.imag, color=style.BLACK, label=f"branch {number:.0f}")
    upper.axhline(0.0, color=style.GREY, linewidth=0.6)
    top = 1.04 * float(np.nanmax(eigenvalue.imag)) if options.top is None else options.top
    critical, orders, _ = result.critical
    for order in np.unique(orders):
        lower.plot(speed, order * speed, color=style.GREY, linewidth=0.6, linestyle="--", label=f"order {order:g}")
    lower.plot(critical, orders * critical, "o", markersize=2.5, color=style.BLACK, label="critical speeds")
    if np.isfinite(result.stability_limit):
        for axes in (upper, lower):
            axes.axvline(
                result.stability_limit, color=style.RED, linewidth=0.8, linestyle="-.", label="stability limit"
            )
        words = f"unstable above {result.stability_limit:.1f} rad/s"
        upper.annotate(words, (result.stability_limit, upper.get_ylim()[1]), (-4, -4), textcoords="offset points",
                       ha="right", va="top", fontsize=8.0, color=style.RED)  # fmt: skip
    low = speed[0] if options.start is None else options.start
    high = speed[-1] if options.stop is None else options.stop
    lower.set_xlim(low, high)
    lower.set_ylim(0.0, top)
    upper.set_ylabel("real part (1/s)")
    lower.set_ylabel("imaginary part (rad/s)")
    lower.set_xlabel("angular speed (rad/s)")
    style.set_footer(figure, result, options)
    style.set_heading(figure, (upper, upper), style.title_of(result, options), [])
