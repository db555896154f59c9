"""Start the programs as a user does, and look at what they leave."""

import contextlib
import importlib
import io
import os
import re
import subprocess
import sys
from pathlib import Path

import h5py

SOURCE = Path(os.environ["RAZY_SOURCE"])
BUILD = Path(os.environ["RAZY_BUILD"])
GEAR_PAIR = SOURCE / "inputs" / "torsional_gear_pair.nml"
TWO_SIDED_STOP = SOURCE / "inputs" / "two_sided_stop.nml"
PATIENCE = 120
# Alone, a program needs neither daemon nor folders nor networks of Open MPI, which take longer than most motions.
ALONE = {
    "OMPI_MCA_ess_singleton_isolated": "1",
    "OMPI_MCA_orte_create_session_dirs": "0",
    "OMPI_MCA_pml": "ob1",
    "OMPI_MCA_btl": "self",
}
sys.path.insert(0, str(SOURCE / "post" / "src"))


def command(program, *arguments, ranks=None):
    words = [str(BUILD / "bin" / program), *map(str, arguments)]
    return words if ranks is None else [os.environ["RAZY_MPIEXEC"], "-n", str(ranks), *words]


def start(program, *arguments, ranks=None, timeout=PATIENCE):
    """Run a program to its end, whatever its exit code, in the current folder."""
    words = command(program, *arguments, ranks=ranks)
    environment = os.environ | (ALONE if ranks is None else {})
    return subprocess.run(
        words, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=timeout, env=environment
    )


def succeed(program, *arguments, **options):
    done = start(program, *arguments, **options)
    assert done.returncode == 0, done.stderr
    return done


def call(module, *arguments, main="main"):
    """Run a tool of the Python package in this process: each of its own would take a second to import matplotlib."""
    said, complained = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(complained):
        try:
            code = getattr(importlib.import_module(module), main)([str(word) for word in arguments])
        except SystemExit as end:
            code = end.code
    return subprocess.CompletedProcess(arguments, code, said.getvalue(), complained.getvalue())


def plot(*arguments):
    return call("razy.plot.cli", *arguments)


def sets(**values):
    """Options of --set; `motion__t_end=0.1` is motion%t_end=0.1."""
    return [word for key, value in values.items() for word in ("--set", f"{key.replace('__', '%')}={value}")]


def changed(path, text, *changes):
    """Write the text of an input with substitutions, each of which must apply once."""
    for old, new in changes:
        text, count = re.subn(old, new, text)
        assert count == 1, (old, count)
    path.write_text(text)
    return path


def datasets(path):
    """Return every dataset as (type, shape, bytes), but those of nothing but object references."""
    found = {}

    def keep(name, item):
        if isinstance(item, h5py.Dataset):
            values = item[()]
            # Strings are read as objects, whose bytes are addresses.
            content = repr(values.tolist()) if h5py.check_string_dtype(item.dtype) else values.tobytes()
            found[name] = (item.dtype.str, item.shape, content)

    with h5py.File(path) as file:
        file.visititems(keep)
    assert found
    return found


def values_of(path):
    """Return the values of every dataset."""
    found = {}
    with h5py.File(path) as file:
        file.visititems(lambda name, item: found.update({name: item[()]}) if isinstance(item, h5py.Dataset) else None)
    return found


def run(case, *options, output="run.h5"):
    """Compute one motion, and return the values of every dataset."""
    succeed("razy-run", case, *options, "--output", output, "--force")
    return values_of(output)


def modes(case, *options):
    """Return what razy-modes says of a case, and the datasets at the top of its file."""
    done = succeed("razy-modes", case, *options, "--output", "modes.h5", "--force")
    with h5py.File("modes.h5") as file:
        return done.stdout, {name: item[()] for name, item in file.items() if isinstance(item, h5py.Dataset)}


def attribute(path, name):
    with h5py.File(path) as file:
        return file.attrs[name]


def left():
    """Return the names of what lies in the current folder."""
    return sorted(path.name for path in Path().iterdir())


def names(path):
    found = []
    with h5py.File(path) as file:
        file.visit(found.append)
    return found


def folder_of_openblas():
    """A folder with BLAS and LAPACK by OpenBLAS with threads, or None."""
    folders = Path("/usr/lib").glob("*/openblas-pthread")
    return next((folder for folder in folders if (folder / "liblapack.so.3").exists()), None)
