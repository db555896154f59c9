"""Compare the machines of all inputs with data/machines.txt, matrix by matrix; exit code 1 if they differ.

usage: check_machines.py PROGRAM SOURCE [--update]

PROGRAM is `write_machines`. `--update` writes the file anew, for inputs that are new or meant to be others.
"""

import subprocess
import sys
from pathlib import Path

# Modal damping has the rounding of eigenvectors, of which each LAPACK has its own.
TOLERANCE = 1e-9


def values(text):
    """Return the numbers of each input by their names, in their order."""
    found = {}
    for line in text.splitlines():
        file, name, value = line.split()
        found.setdefault(file, []).append((name, float(value)))
    return found


def differences(ours, stored):
    """Return a line for each input whose machine is another, with the first number that is."""
    for file in sorted(ours.keys() | stored.keys()):
        one, other = ours.get(file, []), stored.get(file, [])
        if [name for name, _ in one] != [name for name, _ in other]:
            yield f"{file}: another number of parts, or not in both"
            continue
        for (name, value), (_, was) in zip(one, other, strict=True):
            if abs(value - was) > TOLERANCE * max(abs(was), name.endswith(("acting", "skew"))):
                yield f"{file}: {name} is {value!r}, was {was!r}"
                break


def main():
    program, source, *options = sys.argv[1:]
    inputs = sorted(path.relative_to(source).as_posix() for path in (Path(source) / "inputs").rglob("*.nml"))
    done = subprocess.run([program, *inputs], cwd=source, capture_output=True, text=True)
    if done.returncode:
        sys.exit(done.stderr)
    file = Path(__file__).parent / "data" / "machines.txt"
    if options == ["--update"]:
        file.write_text(done.stdout)
        return
    told = list(differences(values(done.stdout), values(file.read_text())))
    sys.exit("\n".join(told) or 0)


if __name__ == "__main__":
    main()
