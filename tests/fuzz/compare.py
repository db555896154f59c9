"""One scene by `exact`, `dop853` and the code in follow.py: where they part by more than after a disturbance."""

import os
import re
import subprocess
import sys
from pathlib import Path

# Threads cost more than products of matrices of this size.
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import follow
import h5py
import numpy as np

import scenes

RUN = Path(os.environ["RAZY_BUILD"]) / "bin" / "razy-run"
PATIENCE = 60
# Parts of the largest displacement that are not looked at, and what a difference may be of the effect of a disturbance.
FLOOR = {"exact": 1e-9, "dop853": 1e-6}
FACTOR = {"exact": 100.0, "dop853": 1000.0}
LOST = 1e-3
# Part of the motion's length within which two codes end at the same place.
SAME_END = 1e-6
# The same where laws contradict each other, from where rounding may carry a motion on.
CREPT = 1e-2
# The absolute tolerance is for motions of a metre, and these have 0.1 mm.
FAST = ["motion%integrator='dop853'", "motion%relative_tolerance=1e-13", "motion%absolute_tolerance=1e-18"]


def run_razy(folder, text, name, settings):
    """Times, displacements, what razy-run says of its end, and its near misses."""
    (folder / "scene.nml").write_text(text)
    words = [word for setting in settings for word in ("--set", setting)]
    result = folder / f"{name}.h5"
    command = [RUN, folder / "scene.nml", "--force", "--output", result, *words]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE)
    if done.returncode not in (0, 1) or not result.exists():
        return None, None, f"{name}: exit {done.returncode}: {done.stderr.strip()[-200:]}", 0
    with h5py.File(result) as file:
        missed = int(file["outcome/near_misses"][0])
        end = "" if done.returncode == 0 else f"{name}: {done.stderr.strip()[-200:]}"
        return file["state/time"][:], file["state/displacement"][:], end, missed


def own(text, times, disturbed, **more):
    follower = follow.Follower(text, most_events=4000, most_steps=60000, disturbed=disturbed, **more)
    return follower.run(times)[:, : follower.machine.n]


def limited(end):
    """When a motion ended at a limit of events or of time, or None."""
    stopped = re.search(r"ended at (\S+) s: (chatter|event|time) limit reached", end)
    return float(stopped[1]) if stopped else None


def contradicts(text, end, other):
    """Whether `dop853` or the code in follow.py finds no branch that lasts either, where `exact` ended at a limit.

    Laws contradict each other there: friction that goes with a stop pulls it open, or presses its damper closed.
    From there rounding may carry a motion on in steps of nanoseconds: it ends later, or no time is left.
    """
    stopped, also = limited(end), limited(other)
    if stopped is None:
        return False
    t_end = float(re.search(r"t_end=([-+.0-9e]+)", text)[1])
    if also is not None and -SAME_END * t_end < stopped - also < CREPT * t_end:
        return True
    try:
        own(text, [min(t_end, stopped + SAME_END * t_end)], False)
    except follow.GaveUpError as error:
        return -SAME_END * t_end < stopped - float(str(error).split("at ")[1]) < CREPT * t_end
    return False


def part(a, b, size):
    """The largest difference so far, at every time, in parts of the largest displacement."""
    return np.maximum.accumulate(np.max(np.abs(a - b), axis=1)) / size


def stiffened(text):
    """The text with its first stiffness changed by 1e-12: hops that lose nothing add up what matrices round."""
    return re.sub(
        r"stiffness=([-+.0-9e]+)", lambda found: f"stiffness={float(found[1]) * (1 + 1e-12):.17g}", text, count=1
    )


def compare(text, folder):
    """(verdict, what is wrong): 'agree', 'undecided' where the code in follow.py gives up, 'differ'.

    Machines that the code in follow.py does not know are followed by `exact` and `dop853` alone.
    """
    times, exact, end, _ = run_razy(folder, text, "exact", [])
    wrong = [end] if end else []
    if times is None:
        return "differ", wrong
    alone = "kind='lumped'" not in text
    speed = float(re.search(r"velocity=([-+.0-9e]+)", text)[1])
    disturbed = stiffened(text) if alone else text
    _, shaken, _, _ = run_razy(folder, disturbed, "shaken", [f"initial(1)%velocity={speed * (1 + 1e-12):.17g}"])
    # Where a method with tolerances ends early it says so.
    _, other, fell, missed = run_razy(folder, text, "dop853", FAST)
    if len(times) < 2:
        return "undecided", wrong
    try:
        mine = None if alone else own(text, times, False)
        disturbed = None if alone else own(text, times, True)
    except follow.GaveUpError:
        mine = None
        # Laws that contradict each other, or events without end: both say so.
        if wrong and all("limit reached" in line for line in wrong):
            return "undecided", []
    if len(wrong) == 1 and mine is not None and contradicts(text, wrong[0], fell):
        wrong = []
    size = np.max(np.abs(exact)) + 1e-300
    rows = min(len(values) for values in (exact, shaken, other, mine) if values is not None)
    # On the edge of a law whose force jumps a motion may have to stay, which no branch does.
    if wrong and "switched_spring" in text and all("limit reached" in line for line in wrong):
        return "undecided", []
    # Bodies between several rigid stops may rattle more often than is allowed.
    if wrong and "kind='planar'" in text and all("event limit reached" in line for line in wrong):
        return "undecided", []
    explained = part(exact[:rows], shaken[:rows], size) if shaken is not None else np.zeros(rows)
    if mine is not None:
        explained = np.maximum(explained, part(mine[:rows], disturbed[:rows], size))
        apart = part(exact[:rows], mine[:rows], size)
        if excess("exact", apart, explained, times):
            # Impacts soon after each other may be one or several.
            try:
                single = own(text, times, True, joins=2)
                explained = np.maximum(explained, part(mine[:rows], single[:rows], size))
            except follow.GaveUpError:
                pass
        wrong += excess("exact", apart, explained, times)
    if other is not None and missed == 0:
        wrong += excess("dop853", part(exact[:rows], other[:rows], size), explained, times)
    if wrong:
        return "differ", wrong
    return ("agree" if mine is not None or (alone and other is not None) else "undecided"), []


def excess(name, apart, explained, times):
    """Where a difference is more than a disturbance makes, before that has grown beyond use."""
    bad = (apart > FLOOR[name] + FACTOR[name] * explained) & (explained < LOST)
    if not bad.any():
        return []
    i = int(np.argmax(bad))
    return [
        f"{name} parts by {apart[i]:.1e} at {times[i]:.6g} s, where a disturbance of 1e-12 makes {explained[i]:.1e}"
    ]


def main(first, last, folder, kind="text_of"):
    """Print what is to be looked at, and how many scenes there were of each verdict."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    verdicts = {}
    for seed in range(int(first), int(last)):
        verdict, wrong = compare(getattr(scenes, kind)(seed), folder)
        verdicts[verdict] = verdicts.get(verdict, 0) + 1
        if verdict != "agree":
            print(seed, verdict, *wrong, flush=True)
    print(verdicts)


if __name__ == "__main__":
    main(*sys.argv[1:])
