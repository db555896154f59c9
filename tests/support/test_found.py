"""A pFUnit is taken if it is new enough and has MPI where tests need it; else the stand-in, and CMake says why."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

RAZY_TESTS = Path(__file__).parents[2] / "cmake" / "RazyTests.cmake"
PROJECT = f"""\
cmake_minimum_required(VERSION 3.25)
project(probe LANGUAGES NONE)
include({RAZY_TESTS})
message(STATUS "taken: ${{razy_pfunit}}")
"""
WITH_MPI = "set(PFUNIT_MPI_FOUND TRUE)\n"

# (config file of the pFUnit that is there, options, whether it is taken, what CMake says)
CASES = [
    (None, [], "OFF", "pFUnit not found"),
    ('set(PFUNIT_VERSION 4.16.0)\n' + WITH_MPI, [], "ON", "Tests: pFUnit 4.16.0"),
    ('set(PFUNIT_VERSION 4.16.0)\n' + WITH_MPI, ["-DCMAKE_DISABLE_FIND_PACKAGE_PFUNIT=ON"], "OFF", "pFUnit not found"),
    ('set(PFUNIT_VERSION 4.16.0)\n', [], "OFF", "4.16.0 was built without MPI"),
    ('set(PFUNIT_VERSION 4.16.0)\n', ["-DRAZY_PROGRAMS=OFF"], "ON", "Tests: pFUnit 4.16.0"),
    ('set(PFUNIT_VERSION 4.9.0)\n' + WITH_MPI, [], "OFF", "4.9.0 is older than 4.14"),
]  # fmt: skip


def configure(cmake: str, config: str | None, options: list[str]) -> str:
    """What CMake prints for a project that includes the module, beside a pFUnit with this config file."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "CMakeLists.txt").write_text(PROJECT, encoding="utf-8")
        if config is not None:
            Path(folder, "PFUNITConfig.cmake").write_text(config, encoding="utf-8")
        words = [cmake, "-S", folder, "-B", f"{folder}/build", f"-DPFUNIT_DIR={folder}", "-DRAZY_PROGRAMS=ON", *options]
        return subprocess.run(words, capture_output=True, text=True, check=True).stdout


def main() -> int:
    """Exit code: whether any case came out otherwise."""
    wrong = 0
    for config, options, taken, says in CASES:
        printed = configure(sys.argv[1], config, options)
        if f"taken: {taken}\n" not in printed or says not in printed:
            wrong = 1
            print(f"{config!r} {options}: expected {taken} and '{says}':\n{printed}", file=sys.stderr)
    return wrong


if __name__ == "__main__":
    sys.exit(main())
