"""The command ``razy-doctor``: what razy finds on this computer, in ten lines for a report of a fault."""

import ctypes
import os
import platform
import re
import shutil
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from razy.errors import Parser, ResultError
from razy.programs.process import find_program, listen
from razy.version import __version__

PROGRAM = "razy-doctor"
PACKAGES = ("numpy", "h5py", "matplotlib", "xarray", "f90nml", "typeguard", "bokeh", "meshio", "python-flint")
PATIENCE = 20.0
"""Seconds that a program has to say its version."""


def findings(program: Path | None) -> list[tuple[str, str]]:
    """Return what there is and what was found of it; `program` is razy-run, if there is one."""
    libraries = _libraries(program)
    return [
        ("razy", f"{_first_line([program, '--version'])}, {program}" if program else "no program razy-run"),
        ("system", f"{_system()}, {platform.machine()}, kernel {platform.release()}"),
        ("processor", f"{_processor()}, {len(os.sched_getaffinity(0))} cores to use, {_memory()}"),
        ("Fortran", _first_line(["gfortran", "--version"])),
        ("C", _first_line(["gcc", "--version"])),
        ("MPI", _first_line(["mpirun", "--version"])),
        ("BLAS", _blas(libraries)),
        ("HDF5", ", ".join(sorted(str(path) for name, path in libraries.items() if "hdf5" in name)) or "not found"),
        ("Python", f"{platform.python_version()}, {sys.executable}: {', '.join(map(_package, PACKAGES))}"),
        ("disk", f"{shutil.disk_usage(Path.cwd()).free / 1e9:.1f} GB free in {Path.cwd()}"),
    ]


def _first_line(words: list[str | Path]) -> str:
    return next(iter(listen(words, PATIENCE)), f"{words[0]} says nothing")


def _libraries(program: Path | None) -> dict[str, Path]:
    """Return the shared libraries that a program takes, by name."""
    if program is None or shutil.which("ldd") is None:
        return {}
    said = "\n".join(listen(["ldd", program], PATIENCE))
    return {name: Path(path).resolve() for name, path in re.findall(r"(\S+) => (/\S+)", said)}


def _blas(libraries: dict[str, Path]) -> str:
    """Return the files of BLAS and LAPACK; of OpenBLAS also the kernel that it chose for this processor."""
    found = sorted({path for name, path in libraries.items() if re.search("blas|lapack|mkl|blis", name)})
    said = ", ".join(map(str, found)) or "not found"
    for path in found:
        try:
            name = ctypes.CDLL(str(path)).openblas_get_corename
        except (OSError, AttributeError):
            continue
        name.restype = ctypes.c_char_p
        return f"{said}, kernel {name().decode()}"
    return said


def _system() -> str:
    try:
        return platform.freedesktop_os_release()["PRETTY_NAME"]
    except (OSError, KeyError):
        return platform.system()


def _processor() -> str:
    path = Path("/proc/cpuinfo")
    models = re.findall(r"model name\s*: (.*)", path.read_text()) if path.exists() else []
    return models[0] if models else platform.processor() or "unknown processor"


def _memory() -> str:
    return f"{os.sysconf('SC_PHYS_PAGES') * os.sysconf('SC_PAGE_SIZE') / 1e9:.0f} GB of memory"


def _package(name: str) -> str:
    try:
        return f"{name} {version(name)}"
    except PackageNotFoundError:
        return f"no {name}"


def main(arguments: list[str] | None = None) -> int:
    """Run the command; return its exit code."""
    parser = Parser(
        prog=PROGRAM,
        description="Say what razy finds on this computer: compilers, MPI, BLAS, HDF5, Python, disk.",
        epilog="Exit code: 0 done, 1 there is no razy-run, 2 bad usage.",
        allow_abbrev=False,
    )
    parser.add_argument("--programs", metavar="FOLDER", type=Path, help="folder of razy's programs")
    parser.add_argument("--version", action="version", version=f"{PROGRAM} {__version__}")
    given = parser.parse_args(arguments)
    try:
        program = find_program("razy-run", given.programs)
    except ResultError:
        program = None
    for name, value in findings(program):
        print(f"{name + ':':<11}{value}")
    return int(program is None)


if __name__ == "__main__":
    sys.exit(main())
