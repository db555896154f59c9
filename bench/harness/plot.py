"""The report as a picture: error against cost, one line for each code and method."""

import math

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from harness import cases

MARKERS = "osD^v<>PX*hdp8"
COLOURS = {
    "razy": "C3",
    "razy DOP853": "C6",
    "heyoka": "C0",
    "DOP853 Fortran": "k",
    "Boost.odeint": "C8",
    "GSL": "C9",
    "ARKODE": "C2",
    "CVODE": "C1",
    "SciPy": "C4",
    "Octave ode45": "C5",
}


def method(row):
    """Setting without its tolerance: what one line of the plot joins."""
    words = row["setting"].split(":")
    tolerances = [
        i for i, word in enumerate(words) if word == "default" or word.replace("e-", "").replace(".", "").isdigit()
    ]
    if row["code"] == "heyoka":
        words = words[:2]
    elif tolerances:
        del words[tolerances[0]]
    plain = ("inf", "exact", "dop853")
    return " ".join([row["code"], *(word for word in words if word not in plain)])


def draw(axes, rows, cost, error, styles):
    lines = {}
    for row in rows:
        lines.setdefault(method(row), []).append(row)
    for name, points in lines.items():
        points.sort(key=error)
        if name not in styles:
            colour = COLOURS[points[0]["code"]]
            styles[name] = (MARKERS[sum(colour == other for _, other in styles.values())], colour)
        marker, colour = styles[name]
        x, y = [cost(p) for p in points], [max(error(p), 1e-16) for p in points]
        axes.loglog(x, y, marker=marker, color=colour, label=name, linewidth=1, markersize=5)
    axes.axhline(cases.RIGHT, color="0.5", linewidth=0.8, linestyle="--")
    axes.grid(True, which="major", color="0.9")


def work_precision(data, path):
    figure, (left, right) = plt.subplots(1, 2, figsize=(13, 7.5), layout="constrained", sharey=True)
    styles = {}
    p2 = [row for row in data["rows"] if row["case"] == "p2"]
    p3 = [row for row in data["rows"] if row["case"] == "p3" and not math.isnan(row["worst"])]
    draw(left, p2, lambda row: row["cpu"] / cases.P2_DURATION, lambda row: row["error"], styles)
    draw(right, p3, lambda row: row["cpu_all"], lambda row: row["worst"], styles)
    lossy = [row for row in p3 if row["lost"]]
    right.loglog(
        [row["cpu_all"] for row in lossy], [row["worst"] for row in lossy], "x", color="k", markersize=10, label="_"
    )
    left.set(
        xlabel="CPU time, s per simulated s", ylabel="largest error of d, relative", title="P2: one motion at 3000 rpm"
    )
    right.set(xlabel="CPU time of all 401 speeds, s", title="P3: extrema at regular speeds (× speeds lost)")
    handles = dict(zip(*reversed(left.get_legend_handles_labels()), strict=True))
    handles |= dict(zip(*reversed(right.get_legend_handles_labels()), strict=True))
    figure.legend(handles.values(), handles.keys(), loc="outside right upper", fontsize="small", frameon=False)
    figure.savefig(path, dpi=130)
    plt.close(figure)
