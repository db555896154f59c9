"""Count the modules that a piece of `exact`, or a step of DOP853, goes through: at most 15 each.

A run of a build without inlining across modules (the debug preset) is watched by callgrind. A module counts if one of
its procedures is entered within a piece or a step, from its start to its end with what follows there; what is made once
for a mode (eigenmodes, response, rows) and what observers do is left out.
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
# Within these everything counts, but for what they call to make a mode ready or to show a piece.
WITHIN = {
    "exact": ("exact_exact_MOD_enter", "exact_exact_MOD_advance", "hybrid_flow_MOD_end_piece"),
    "dop853": ("runge_kutta_runge_kutta_MOD_advance", "hybrid_flow_MOD_end_piece"),
}
WITHOUT = ("exact_solutions_MOD_find_eigenmodes", "exact_solutions_MOD_respond", "motion_integrator_MOD_show_piece")


def modules(program: Path, case: Path, integrator: str) -> list[str]:
    """The modules that the integrator goes through on its way."""
    toggles = [f"--toggle-collect=__razy_{name}" for name in (*WITHIN[integrator], *WITHOUT)]
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder, "callgrind.out")
        command = ["valgrind", "--tool=callgrind", "--collect-atstart=no", *toggles, f"--callgrind-out-file={out}"]
        command += [str(program), str(case), "--set", f"motion%integrator='{integrator}'"]
        command += ["--output", str(Path(folder, "run.h5"))]
        subprocess.run(command, check=True, capture_output=True)
        text = out.read_text(encoding="utf-8")
    entered = set(re.findall(r"fn=\(\d+\)(?: __(razy_\w+)_MOD_\w+)?", text))
    return sorted(entered - {""})


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
