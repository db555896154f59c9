"""Run a test program of the stand-in and compare what it reports with the sample file it was made of.

The failures reported must be those on the lines after `! must fail`, no more and no fewer, with the closing lines and
the exit code that pFUnit has. Arguments after `--` are the command.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
from pathlib import Path

PASS_EXPRESSION = r"(^|\n) OK\n"
HANG_SECONDS = 3


def expected_lines(source: Path) -> list[str]:
    """`file:line` of every assertion that must fail."""
    lines = source.read_text(encoding="utf-8").splitlines()
    return [f"{source.name}:{at + 2}" for at, line in enumerate(lines) if line.strip() == "! must fail"]


def has_in_order(lines: list[str], wanted: list[str]) -> bool:
    """Whether the wanted lines are there in this order; mpiexec may put those of other ranks between them."""
    rest = iter(lines)
    return all(line in rest for line in wanted)


def run(command: list[str], hangs: bool) -> tuple[int | None, str]:
    """Exit code and output of a command; no exit code if it had to be ended because it hangs."""
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    try:
        output, _ = process.communicate(timeout=HANG_SECONDS if hangs else None)
    except subprocess.TimeoutExpired:
        process.terminate()
        output, _ = process.communicate()
        return None, output
    return process.returncode, output


def main() -> int:
    """Command line; see the module's text."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("source", type=Path)
    parser.add_argument("--tests", type=int, default=0)
    parser.add_argument("--failures", type=int, default=0)
    parser.add_argument("--disabled", type=int, default=0, help="looked for if there are no failures")
    parser.add_argument("--hangs", action="store_true", help="the program waits for ever after its failures")
    parser.add_argument("--stops", action="store_true", help="the program ends with code 0 in the middle")
    parser.add_argument("command", nargs="+")
    args = parser.parse_args()
    code, output = run(args.command, args.hangs)
    print(output)

    if args.hangs or args.stops:
        expected_code, closing = None if args.hangs else 0, ""
    elif args.failures:
        expected_code = 2
        closing = (
            f"\n FAILURES!!!\nTests run: {args.tests}, Failures: {args.failures}, Errors: 0\n"
            "*** Encountered 1 or more failures/errors during testing ***\n"
        )
    else:
        disabled = f", {args.disabled} disabled" if args.disabled else ""
        expected_code, closing = 0, f"\n OK\n ({args.tests} tests{disabled})\n"
    problems = [] if code == expected_code else [f"exit code {code}, not {expected_code}"]
    reported = set(re.findall(r"^\[(.+:\d+)\]$", output, re.MULTILINE))
    expected = set(expected_lines(args.source))
    problems += [f"no failure at {place}" for place in sorted(expected - reported)]
    problems += [f"a failure at {place}" for place in sorted(reported - expected)]
    if not has_in_order(output.splitlines(), closing.strip("\n").splitlines()):
        problems.append(f"the closing lines are not{closing}")
    if bool(re.search(PASS_EXPRESSION, output)) != (" OK" in closing):
        problems.append("the output matches the expression for success, or should have")
    for problem in problems:
        print(f"{args.source.name}: {problem}", file=sys.stderr)
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
