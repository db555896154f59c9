"""Map of a sweep over two parameters: a number of each point as colour, such as a force, an amplitude or the period."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from razy.errors import ResultError
from razy.plot import periods, style
from razy.plot.options import PlotOptions
from razy.plot.units import axis_label, readable_name, scale_for
from razy.read import DOWN, Quantity, SweepResult
from razy.read.file import choose


def draw(result: SweepResult, figure: Figure, options: PlotOptions) -> None:
    """Draw a map of each quantity asked for; by default of the largest force, else the amplitude, and of the period."""
    if len(result.parameters) != 2:
        raise ResultError(
            f"{result.path}: a map needs a sweep over two parameters, this one has {len(result.parameters)}"
        )
    if options.coordinates:
        raise ResultError(
            f"{result.path}: a map takes --observable period, CONTACT.QUANTITY, OBSERVABLE.rms, OBSERVABLE.mean "
            "or an observable, no coordinates"
        )
    names = options.observables or default_names(result)
    if not names:
        raise ResultError(f"{result.path}: holds no statistics of contacts, averages, extrema or period of the motions")
    style.set_size(figure, options, 16.0, 9.5 if len(names) == 1 else 8.0 * len(names) + 1.0)
    style.set_footer(figure, result, options)
    column = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
    first, second = result.parameters
    x, y = result.axis(first), result.axis(second)
    selected = np.ones(x.size, dtype=bool)
    selected &= x >= options.start if options.start is not None else True
    selected &= x <= options.stop if options.stop is not None else True
    if not np.any(selected):
        raise ResultError(f"{result.path}: no point of {first} {options.range_text()}")
    x_scale = scale_for(result.parameter(first).units, float(np.abs(x).max()))
    y_scale = scale_for(result.parameter(second).units, float(np.abs(y).max()))
    for axes, name in zip(column, names, strict=True):
        shown = values(result, name).reshape(-1, x.size, y.size)[0][selected]
        fill(result, axes, name, (edges(x[selected] * x_scale.factor), edges(y * y_scale.factor)), shown)
        axes.set_ylabel(axis_label(result.parameter(second), y_scale))
    column[-1].set_xlabel(axis_label(result.parameter(first), x_scale))
    title = style.title_of(result, options)
    if title and result.direction is not None:
        title += " (downwards)" if result.direction[0] == DOWN else " (upwards)"
    style.set_heading(figure, (column[0], column[0]), title, [])


def default_names(result: SweepResult) -> tuple[str, ...]:
    """Return what is drawn if nothing is asked for."""
    force = tuple(f"{contact}.largest_force" for contact in result.contacts[:1])
    first = force or tuple(result.observables[:1])
    first = first or tuple(f"{average}.rms" for average in result.averages[:1])
    return first + (("period",) if result.period is not None else ())


def values(result: SweepResult, name: str) -> NDArray[np.float64]:
    """Return one number of each point, such as the period."""
    if name == "period":
        if result.period is None:
            raise ResultError(f"{result.path}: does not hold the period of the motions (&sweep kind_of_motion)")
        return result.period
    values = _amplitude(result, name) if name in result.observables else result.contact_value(*_statistic(result, name))
    return result.where_followed(values)


def describe(result: SweepResult, name: str) -> Quantity:
    """Describe what `values` returns."""
    if name == "period":
        return Quantity(name, "1", "period of the motion")
    if name in result.observables:
        quantity = result.extrema(name).quantity
        return Quantity(name, quantity.units, f"amplitude of {readable_name(quantity)}")
    return result.contact_quantity(*_statistic(result, name))


def _statistic(result: SweepResult, name: str) -> tuple[str, str]:
    """Return contact and quantity."""
    contact, dot, quantity = name.rpartition(".")
    if not dot:
        known = [*result.observables, *(f"{contact}.QUANTITY" for contact in result.contacts), "period"]
        known += [f"{average}.rms" for average in result.averages]
        choose(name, known, "observable", result.path)
    return contact, quantity


def _amplitude(result: SweepResult, observable: str) -> NDArray[np.float64]:
    """Return half the distance between the largest and the smallest extremum of each point, NaN where there is none."""
    low, high = np.full(result.n_points, np.inf), np.full(result.n_points, -np.inf)
    for chunk in result.extrema(observable).chunks():
        np.minimum.at(low, chunk.point, chunk.value)
        np.maximum.at(high, chunk.point, chunk.value)
    return np.where(low <= high, 0.5 * (high - low), np.nan)


def fill(
    result: SweepResult, axes: Axes, name: str, edges: tuple[NDArray, NDArray], values: NDArray[np.float64]
) -> None:
    """Fill the cells between the edges with colours."""
    axes.tick_params(which="both", direction="out")
    if name == "period":
        classes = periods.classes_of(values)
        axes.pcolormesh(*edges, classes.T, cmap=periods.COLOURS, norm=periods.NORM, rasterized=True)
        periods.legend(axes, np.unique(classes))
        return
    described = describe(result, name)
    finite = values[np.isfinite(values)]
    scale = scale_for(described.units, float(np.abs(finite).max()) if finite.size else 0.0)
    mesh = axes.pcolormesh(*edges, values.T * scale.factor, cmap="viridis", rasterized=True)
    axes.figure.colorbar(mesh, ax=axes, label=axis_label(described, scale), pad=0.02)


def edges(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the edges of the cells around ascending or descending values."""
    if values.size == 1:
        return np.array([values[0] - 0.5, values[0] + 0.5])
    middle = 0.5 * (values[1:] + values[:-1])
    return np.concatenate(([1.5 * values[0] - 0.5 * values[1]], middle, [1.5 * values[-1] - 0.5 * values[-2]]))
