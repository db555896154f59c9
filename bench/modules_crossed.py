"""Count the modules that a piece of `exact`, or a step of DOP853, goes through: at most 15 each.

A run of a build without inlining across modules (the debug preset) is watched by callgrind. A module counts if one of
its procedures does anything within the loop over pieces. What is made once for a motion or a mode (start, eigenmodes,
response, rows) and what observers do is left out; of a step also what begins a mode and what follows an event.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
from pathlib import Path

MOST = 15
CASES = {
    "exact": "one piece of exact",
    "dop853": "one step of DOP853",
}
LOOP = "hybrid_flow_MOD_run"
# What the loop calls that does not count, with all that it calls in turn
WITHOUT = (
    "hybrid_transition_MOD_begin",
    "hybrid_switching_MOD_begin",
    "hybrid_system_MOD_first_state",
    "exact_solutions_MOD_find_eigenmodes",
    "exact_solutions_MOD_respond",
    "motion_integrator_MOD_show_piece",
)
NO_STEP = ("hybrid_transition_MOD_settle", "runge_kutta_runge_kutta_MOD_enter")


def busy(profile: str) -> set[str]:
    """The procedures that have cost of their own in a profile of callgrind."""
    names: dict[str, str] = {}
    found, now, of_call = set(), "", False
    for line in profile.splitlines():
        if match := re.match(r"(c?)fn=\((\d+)\)(?: (\S+))?", line):
            name = names.setdefault(match[2], match[3] or "")
            now = now if match[1] else name
        elif line.startswith("calls="):
            of_call = True
        elif re.match(r"[+\-*\d]", line):
            if not of_call and int(line.split()[-1]) > 0:
                found.add(now)
            of_call = False
    return found


def modules(program: Path, case: Path, integrator: str) -> list[str]:
    """The modules that the integrator goes through on its way."""
    toggles = [f"--toggle-collect=__razy_{name}" for name in (LOOP, *WITHOUT, *NO_STEP)]
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder, "callgrind.out")
        command = ["valgrind", "--tool=callgrind", "--collect-atstart=no", *toggles, f"--callgrind-out-file={out}"]
        command += [str(program), str(case), "--set", f"motion%integrator='{integrator}'"]
        command += ["--output", str(Path(folder, "run.h5"))]
        subprocess.run(command, check=True, capture_output=True)
        text = out.read_text(encoding="utf-8")
    found = (re.match(r"__(razy_\w+)_MOD_", name) for name in busy(text))
    return sorted({match[1] for match in found if match})


def main() -> int:
    """Command line; see --help."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=Path, help="razy-run of the debug preset")
    parser.add_argument("case", type=Path, help="a machine with compliant contacts, such as inputs/two_sided_stop.nml")
    arguments = parser.parse_args()
    status = 0
    for integrator, what in CASES.items():
        names = modules(arguments.program, arguments.case, integrator)
        print(f"{what}: {len(names)} modules")
        print("\n".join(f"  {name}" for name in names))
        status |= not 0 < len(names) <= MOST
    return status


if __name__ == "__main__":
    sys.exit(main())
