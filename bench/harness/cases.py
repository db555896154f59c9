"""The two cases of the benchmark, and what counts as an error in each."""

from dataclasses import dataclass, field

import numpy as np

P2_SPEEDS = (3000.0, 3000.0, 1.0)
P3_SPEEDS = (1000.0, 2600.0, 4.0)
P3_SAMPLE = (1000.0, 2600.0, 100.0)
P2_DURATION = 0.2
RIGHT = 1e-6
"""Error, relative to the largest |d|, up to which a value counts as right."""

CHAOTIC = ((1592.0, 1600.0), (1636.0, 1660.0), (1768.0, 2104.0))
"""Speeds, rpm, at which a disturbance grows: two right codes differ there point by point."""


def count(speeds):
    first, last, step = speeds
    return round((last - first) / step) + 1


def regular(speed):
    return not any(low <= speed <= high for low, high in CHAOTIC)


@dataclass
class Output:
    """What a program wrote: extrema by speed (time, value, kind), event times, samples (time, d), header."""

    extrema: dict[float, np.ndarray] = field(default_factory=dict)
    events: np.ndarray | None = None
    samples: np.ndarray | None = None
    header: dict[str, float] = field(default_factory=dict)


def read_output(path):
    rows, events, samples = {}, [], []
    output = Output()
    with open(path, encoding="ascii") as lines:
        for line in lines:
            mark, *words = line.split()
            if mark == "x":
                rows.setdefault(float(words[0]), []).append([float(w) for w in words[1:]])
            elif mark == "d":
                samples.append([float(w) for w in words])
            elif mark == "e":
                events.append(float(words[0]))
            elif mark == "#":
                output.header[words[0]] = float(words[1])
            else:
                raise ValueError(f"{path}: unknown line {line!r}")
    output.extrema = {speed: np.array(sorted(values)) for speed, values in rows.items()}
    output.events = np.array(events) if events else None
    output.samples = np.array(samples) if samples else None
    return output


def score_p2(output, reference):
    """Largest error of d at 2001 times over the largest |d|, and of the event times, s, where they were written."""
    if output.samples is None or len(output.samples) != len(reference.samples):
        raise ValueError("the samples of d are not complete")
    if np.abs(output.samples[:, 0] - reference.samples[:, 0]).max() > 1e-12:
        raise ValueError("d was sampled at other times")
    d = reference.samples[:, 1]
    scores = {"error": float(np.abs(output.samples[:, 1] - d).max() / np.abs(d).max())}
    if output.events is not None and len(output.events) == len(reference.events):
        scores["event_time_error"] = float(np.abs(output.events - reference.events).max())
    return scores


def score_p3(output, reference, speeds):
    """Compare the extrema of the regular speeds one by one, those of the chaotic windows by statistics."""
    first, _, step = speeds
    errors, lost, unlike = [], 0, []
    for speed in (first + i * step for i in range(count(speeds))):
        if not regular(speed):
            continue
        expected, found = reference.extrema[speed], output.extrema.get(speed)
        if found is None or len(found) != len(expected) or (found[:, 2] != expected[:, 2]).any():
            lost += 1
            unlike.append(speed)
            continue
        errors.append(float(np.abs(found[:, 1] - expected[:, 1]).max() / np.abs(expected[:, 1]).max()))
        if errors[-1] > RIGHT:
            unlike.append(speed)
    return {
        "compared": len(errors) + lost,
        "right": sum(error <= RIGHT for error in errors),
        "lost": lost,
        "wrong_speeds": unlike,
        "worst": max(errors, default=float("nan")),
        "median": float(np.median(errors)) if errors else float("nan"),
    }


def chaotic_statistics(output):
    """For each chaotic window: speeds, mean number of extrema at a speed, smallest and largest d."""
    windows = []
    for low, high in CHAOTIC:
        inside = [rows for speed, rows in output.extrema.items() if low <= speed <= high]
        if inside:
            values = np.concatenate([rows[:, 1] for rows in inside])
            windows.append(
                [low, high, len(inside), len(values) / len(inside), float(values.min()), float(values.max())]
            )
    return windows
