"""Statistics of contacts over the swept parameter: by default the largest force in each."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from razy.errors import ResultError
from razy.plot import style
from razy.plot.bifurcation import mark_failed
from razy.plot.options import PlotOptions
from razy.plot.units import LABEL_WIDTH, axis_label, scale_for
from razy.read import DOWN, SweepResult
from razy.read.file import Quantity, choose

COLOURS = ("#000000", *style.EVENT_COLOURS)


def draw(result: SweepResult, figure: Figure, options: PlotOptions) -> None:
    """Draw a panel for each quantity asked for, with a line for each contact that is named, else for all."""
    if len(result.parameters) > 1:
        raise ResultError(f"{result.path}: sweeps over two parameters; its picture is of the kind map")
    if not result.contacts:
        raise ResultError(f"{result.path}: has no statistics of contacts (&record what='statistics')")
    quantities = options.observables or ("largest_force",)
    contacts = options.coordinates or result.contacts
    for contact in contacts:
        choose(contact, result.contacts, "contact", result.path)
    grid = result.grid()
    selected = result.within(options.start, options.stop)
    if not np.any(selected):
        raise ResultError(f"{result.path}: no point of {result.parameters[0]} {options.range_text()}")
    parameter = result.parameter()
    x_scale = scale_for(parameter.units, float(np.abs(grid[selected]).max()))
    style.set_size(figure, options, 16.0, 9.5 if len(quantities) == 1 else 5.0 * len(quantities) + 1.5)
    style.set_footer(figure, result, options)
    column = figure.subplots(len(quantities), 1, sharex=True, squeeze=False)[:, 0]
    for axes, quantity in zip(column, quantities, strict=True):
        values = {
            contact: result.where_followed(result.contact_value(contact, quantity))[selected] for contact in contacts
        }
        described = result.contact_quantity(contacts[0], quantity)
        largest = max((float(np.nanmax(np.abs(v))) for v in values.values() if np.any(np.isfinite(v))), default=0.0)
        scale = scale_for(described.units, largest)
        label = described.long_name.split(": ", 1)[-1]
        axes.set_ylabel(axis_label(Quantity(quantity, described.units, label), scale, LABEL_WIDTH))
        for number, contact in enumerate(contacts):
            for way in _ways(result):
                keep = slice(None) if way is None else result.direction[selected] == way
                axes.plot(
                    grid[selected][keep] * x_scale.factor,
                    values[contact][keep] * scale.factor,
                    color=COLOURS[number % len(COLOURS)],
                    linestyle="--" if way == DOWN else "-",
                    label=contact,
                )
    column[-1].set_xlabel(axis_label(parameter, x_scale))
    shown = grid[selected] * x_scale.factor
    column[-1].set_xlim(style.limits(shown.min(), shown.max(), 0.01))
    handles = [Line2D([], [], color=COLOURS[n % len(COLOURS)], label=contact) for n, contact in enumerate(contacts)]
    handles += mark_failed(result, column, grid * x_scale.factor, selected)
    style.set_heading(figure, (column[0], column[0]), style.title_of(result, options), handles)


def _ways(result: SweepResult) -> tuple[int | None, ...]:
    direction = result.direction
    return (None,) if direction is None else tuple(sorted(np.unique(direction).tolist(), reverse=True))
