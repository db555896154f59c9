"""The report as Markdown."""

import math
import sys
import textwrap

from harness import cases


def seconds(x):
    return "–" if x is None else (f"{x:.4f}" if x < 0.1 else (f"{x:.3f}" if x < 10 else f"{x:.0f}"))


def power(x):
    return "–" if x is None or math.isnan(x) else f"{x:.1e}"


def accuracy(x):
    """An error of the reference, which is compared after reading into double precision."""
    return f"≤ {max(x, sys.float_info.epsilon):.1e}"


def best_p2(rows):
    """The fastest setting whose error counts as right; without one, the most accurate."""
    right = [row for row in rows if row["error"] <= cases.RIGHT]
    return min(right, key=lambda row: row["cpu"]) if right else min(rows, key=lambda row: row["error"])


def best_p3(rows):
    """The fastest setting with all compared speeds right; without one, the fastest of those with most of them right.

    Settings that ran all speeds go before those that ran a sample.
    """
    rows = [row for row in rows if not estimate_mark(row)] or rows
    share = max(row["right"] / row["compared"] for row in rows)
    return min((row for row in rows if row["right"] / row["compared"] == share), key=lambda row: row["cpu_all"])


def by_code(rows, case):
    groups = {}
    for row in rows:
        if row["case"] == case:
            groups.setdefault(row["code"], []).append(row)
    return groups


def chosen(rows, case):
    pick = best_p2 if case == "p2" else best_p3
    return {code: pick(group) for code, group in by_code(rows, case).items()}


def header(*titles):
    return ["| " + " | ".join(titles) + " |", "|" + "---|" * len(titles)]


def estimate_mark(row):
    return "" if row["speeds"] == cases.count(cases.P3_SPEEDS) else "≈ "


def summary(data):
    p2, p3 = chosen(data["rows"], "p2"), chosen(data["rows"], "p3")
    peers = [row["cpu_all"] for code, row in p3.items() if not code.startswith("razy")]
    unit = min(peers) if peers else None
    lines = [
        *header(
            "code",
            "P2, s per simulated s",
            "its error of d",
            "P3, s",
            "regular speeds right",
            "worst error",
            "P3 to best peer",
        ),
    ]
    points = cases.count(cases.P3_SPEEDS)
    names = sorted(p2.keys() | p3.keys(), key=lambda name: p3[name]["cpu_all"] if name in p3 else float("inf"))
    for name in names:
        cells = ["–"] * 6
        if name in p2:
            row = p2[name]
            cells[0] = f"{seconds(row['cpu'] / cases.P2_DURATION)} (`{row['setting']}`)"
            cells[1] = power(row["error"])
            if name not in p3:
                cost = row["cpu"] / cases.P2_DURATION * 0.3 * points
                cells[2] = f"≈ {seconds(cost)} (from P2)"
                cells[5] = f"{cost / unit:.3g}" if unit else "–"
        if name in p3:
            row = p3[name]
            cells[2] = f"{estimate_mark(row)}{seconds(row['cpu_all'])} (`{row['setting']}`)"
            cells[3] = f"{row['right']} of {row['compared']}"
            cells[4] = power(row["worst"])
            cells[5] = f"{row['cpu_all'] / unit:.3g}" if unit else "–"
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return lines


KINDS = {
    "razy": "exact propagator",
    "heyoka": "Taylor series",
    "CVODE": "multistep",
    "SciPy": "Runge–Kutta, multistep; interpreted",
    "Octave ode45": "Runge–Kutta; interpreted",
}
"""Codes that are not compiled Runge–Kutta methods."""


def right_everywhere(rows):
    """The settings of P3 that have all compared speeds right."""
    return [row for row in rows if row["case"] == "p3" and row["right"] == row["compared"]]


def cheapest(rows):
    """All speeds go before a sample of them, of which the time is an estimate."""
    return min(rows, key=lambda row: (bool(estimate_mark(row)), row["cpu_all"]), default=None)


def equal_error_table(data, name="razy DOP853"):
    """The cheapest setting of each code with all speeds right; what `name` needs for that, and for no larger error."""
    groups = by_code(right_everywhere(data["rows"]), "p3")
    own = cheapest(groups.get(name, []))
    if own is None:
        return [f"{name}: not measured, or no setting with all regular speeds right."]
    lines = header(
        "code",
        "method",
        "setting",
        "P3, s",
        "regular speeds right",
        "worst error",
        f"{name}: times as long",
        f"{name} at no larger error, s",
        "times as long",
    )
    best = sorted((cheapest(rows) for rows in groups.values()), key=lambda row: row["cpu_all"])
    for row in best:
        alike = cheapest([mine for mine in groups[name] if mine["worst"] <= row["worst"]])
        cells = ["–", "–"]
        if alike:
            cells = [f"{seconds(alike['cpu_all'])} (`{alike['setting']}`)", f"{alike['cpu_all'] / row['cpu_all']:.2f}"]
        lines.append(
            f"| {row['code']} | {KINDS.get(row['code'], 'Runge–Kutta')} | `{row['setting']}` | "
            f"{estimate_mark(row)}{seconds(row['cpu_all'])} | {row['right']} of {row['compared']} | "
            f"{power(row['worst'])} | {own['cpu_all'] / row['cpu_all']:.2f} | {cells[0]} | {cells[1]} |"
        )
    peers = [row for row in best if not row["code"].startswith("razy")]
    methods = [row for row in peers if row["code"] not in KINDS]
    lines += ["", verdict(own, peers, "peer"), verdict(own, methods, "compiled Runge–Kutta peer")]
    never = sorted({row["code"] for row in data["rows"] if row["case"] == "p3"} - groups.keys())
    if never:
        lines += ["", "No setting with all regular speeds right: " + ", ".join(never) + "."]
    return lines


def verdict(own, peers, kind):
    """One sentence: razy beside the fastest of these peers, which are sorted."""
    if not peers:
        return f"No {kind} was measured."
    best = peers[0]
    ratio = own["cpu_all"] / best["cpu_all"]
    return f"{own['code']} takes {ratio:.2f} times as long as the fastest {kind}, {best['code']} `{best['setting']}`."


def p2_table(data):
    marked = chosen(data["rows"], "p2")
    lines = [
        *header("code", "setting", "CPU, s", "whole process, s", "error of d", "events", "error of event times, s", ""),
    ]
    for name, rows in by_code(data["rows"], "p2").items():
        for row in rows:
            mark = "◀" if row is marked[name] else ""
            count = "–" if row["events"] is None else f"{row['events']:.0f}"
            lines.append(
                f"| {name} | `{row['setting']}` | {seconds(row['cpu'])} | {seconds(row['process'])} | "
                f"{power(row['error'])} | {count} | {power(row.get('event_time_error'))} | {mark} |"
            )
    return lines


def p3_table(data):
    marked = chosen(data["rows"], "p3")
    lines = [
        *header(
            "code",
            "setting",
            "CPU, s, all speeds",
            "speeds run",
            "whole process, s",
            "right",
            "lost",
            "worst error",
            "median",
            "events",
            "",
        ),
    ]
    for name, rows in by_code(data["rows"], "p3").items():
        for row in rows:
            mark = "◀" if row is marked[name] else ""
            count = "–" if row["events"] is None else f"{row['events']:.0f}"
            lines.append(
                f"| {name} | `{row['setting']}` | {estimate_mark(row)}{seconds(row['cpu_all'])} | {row['speeds']} | "
                f"{seconds(row['process'])} | {row['right']} of {row['compared']} | {row['lost']} | "
                f"{power(row['worst'])} | {power(row['median'])} | {count} | {mark} |"
            )
    return lines


def chaotic_table(data):
    lines = [
        *header("code", "setting", "window, rpm", "speeds", "extrema a speed, mean", "smallest d, m", "largest d, m"),
    ]
    full = [row for row in chosen(data["rows"], "p3").values() if not estimate_mark(row)]
    sources = [("reference", data["reference"]["p3_precision"], data["reference"]["chaotic"])]
    sources += [(row["code"], row["setting"], row["chaotic"]) for row in full]
    for name, setting, windows in sources:
        for low, high, speeds, mean, smallest, largest in windows:
            lines.append(
                f"| {name} | `{setting}` | {low:g}–{high:g} | {speeds} | {mean:.1f} | {smallest:.4e} | {largest:.4e} |"
            )
    return lines


def wrong_speeds(data):
    lines = []
    for name, row in chosen(data["rows"], "p3").items():
        if row["wrong_speeds"]:
            speeds = ", ".join(f"{speed:g}" for speed in row["wrong_speeds"])
            lines.append(f"- {name} `{row['setting']}`: not right at {speeds} rpm")
    return lines


def runs(rows):
    """When each code was measured."""
    when = {}
    for row in rows:
        when.setdefault(row["run"], {})[row["code"]] = True
    return "; ".join(f"{', '.join(codes)} {run}" for run, codes in when.items())


def markdown(data):
    reference, machine = data["reference"], data["machine"]
    versions = textwrap.fill(", ".join(f"{name} {version}" for name, version in data["versions"].items()), 140)
    made = (
        f"Made by `bench/run.py --{data['mode']}` on {data['date']}.\n{machine['cpu']}, {machine['cores']} cores; "
        f"{versions}.\n{textwrap.fill('Measured (day, load at the start): ' + runs(data['rows']) + '.', 150)}"
    )
    meaning = (
        "One core, CPU time of the computation without start-up and compilation; the smallest of up to five runs.\n"
        "Errors are relative to the largest |d|.\n"
        f"Reference: error of d {accuracy(reference['p2'])} in P2; {accuracy(reference['p3'])} in P3 "
        f"({reference['p3_precision']} precision, {reference['p3_speeds']} regular speeds checked)."
    )
    choice = (
        f"Each code at its fastest setting with all errors ≤ {cases.RIGHT:g} (or, without one, at its best); "
        "≈ is estimated from a sample of speeds."
    )
    lines = ["# Torsional gear pair: cost and error of several codes", "", made, "", meaning, ""]
    lines += ["![error against cost](report.png)", "", choice, "", *summary(data), ""]
    lines += ["See also [what each part costs](ablation.md) and [ranks and memory](ranks.md).", ""]
    lines += ["## DOP853 with events beside the peers at equal error", ""]
    lines += [
        f"P3.\nEach code at its cheapest setting with all regular speeds right, that is with errors ≤ {cases.RIGHT:g}; "
        "then how many times\nas long razy's DOP853 takes at its own cheapest such setting, and at one whose worst "
        "error is no larger.",
        "",
        *equal_error_table(data),
        "",
    ]
    if data["missing"]:
        lines += ["Not measured: " + "; ".join(f"{k} – {v}" for k, v in data["missing"].items()) + ".", ""]
    if data["failed"]:
        lines += ["Failed:", *(f"- {words}" for words in data["failed"]), ""]
    lines += ["## P2: [0, 0.2] s at 3000 rpm", "", *p2_table(data), ""]
    lines += ["## P3: 1000–2600 rpm, extrema of d in [0.25, 0.3] s", "", *p3_table(data), "", *wrong_speeds(data)]
    lines += ["", "## P3 in the chaotic windows", "", *chaotic_table(data), ""]
    return "\n".join(lines)
