"""The installed package: programs, and a library that another CMake project finds."""

import os
import re
import shutil
import subprocess
import sys
import tomllib
import types
from pathlib import Path
from unittest.mock import patch

import h5py
from programs import BUILD, GEAR_PAIR, PATIENCE, SOURCE, datasets

# What docs/examples/machine_in_code.f90 builds.
SAME_MACHINE = """
&scene  kind='lumped' /
&mass   name='block', value=2.0 /
&spring between='block','frame', stiffness=2.0e4, damping=8.0 /
&stop   name='bumper', between='block','frame', clearance=1.0e-3, stiffness=1.0e6, damping=50.0 /
&load   on='block', value=30.0 /
&motion t_end=0.2, start='zero', integrator='exact' /
&record observable='displacement', what='extrema' /
"""
EXAMPLES = SOURCE / "docs" / "examples"


def run(*words):
    done = subprocess.run(
        list(map(str, words)), stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=PATIENCE
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def check_manual_pages(prefix):
    """Each program has one that says what it is, and that troff reads without a warning."""
    pages = {page.stem: page for page in (prefix / "share" / "man" / "man1").iterdir()}
    assert set(pages) == {path.name for path in (prefix / "bin").glob("razy-*")}
    for name, page in pages.items():
        text = page.read_text()
        assert f"\n.SH NAME\n{name} - ".replace("-", "\\-") in text and "\\-\\-help" in text
        if shutil.which("groff"):
            words = ["groff", "-man", "-ww", "-K", "utf8", "-T", "utf8", page]
            done = subprocess.run(words, capture_output=True, text=True, check=True)
            assert not done.stderr
            assert "--version" in done.stdout.replace("\u2010", "-")


def test_install_and_use(folder):
    cmake = os.environ["RAZY_CMAKE"]
    prefix, consumer = folder / "prefix", folder / "a consumer"
    run(cmake, "--install", BUILD, "--prefix", prefix)
    for program in ("razy-run", "razy-sweep"):
        assert run(prefix / "bin" / program, "--version").startswith(program)
    with_tools = os.environ | {"PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
    for name in ("check", "csv", "doctor", "export", "import-ross", "merge", "plot", "report", "view"):
        tool = f"razy-{name}"
        said = subprocess.run(
            [prefix / "bin" / tool, "--version"], capture_output=True, text=True, env=with_tools, check=True
        )
        assert said.stdout.startswith(tool)
    check_manual_pages(prefix)
    python = prefix / "share" / "razy" / "python"
    for tool, package in (("plot", "matplotlib"), ("csv", "numpy")):
        done = subprocess.run([sys.executable, "-S", prefix / "bin" / f"razy-{tool}"], capture_output=True, text=True)
        assert done.returncode == 1 and done.stderr.count("\n") == 1, done.stderr
        assert done.stderr.startswith(f"razy-{tool}: error: the Python package {package} is missing"), done.stderr
    code = f"import razy; print(razy.run({str(GEAR_PAIR)!r}).program, razy.programs.find_program('razy-run'))"
    alone = os.environ | {"PYTHONPATH": str(python), "PATH": ""}
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=alone, check=True)
    assert said.stdout.split() == ["razy-run", str(prefix / "bin" / "razy-run")]
    assert (prefix / "share" / "razy" / "inputs" / GEAR_PAIR.name).read_text() == GEAR_PAIR.read_text()
    library = next(prefix.rglob("librazy.a")).read_bytes()
    assert b".gnu.lto_" not in library
    assert not [path for path in prefix.rglob("*") if path.suffix == ".mod" and not path.name.startswith("razy_")]
    run(
        cmake, "-S", Path(__file__).parent / "consumer", "-B", consumer, f"-DCMAKE_PREFIX_PATH={prefix}",
        f"-DCMAKE_Fortran_COMPILER={os.environ['RAZY_FORTRAN']}", f"-DRAZY_EXAMPLES={EXAMPLES}",
    )  # fmt: skip
    run(cmake, "--build", consumer)
    lines = run(consumer / "machine_in_code").splitlines()
    (folder / "same.nml").write_text(SAME_MACHINE)
    run(prefix / "bin" / "razy-run", folder / "same.nml", "--output", "same.h5")
    with h5py.File("same.h5") as file:
        extrema = file["extrema/displacement"]
        expected = [f"{t:9.6f} s {1e3 * x:9.6f} mm" for t, x in zip(extrema["time"], extrema["value"], strict=True)]
        assert lines == [f"{file['outcome/events'][0]} events until .200 s", *expected]
    printed = run(consumer / "case_from_file", GEAR_PAIR)
    run(prefix / "bin" / "razy-run", GEAR_PAIR, "--output", "by_program.h5")
    mine, theirs = datasets("case_from_file.h5"), datasets("by_program.h5")
    assert mine == theirs
    assert printed == f"ok: {int.from_bytes(theirs['outcome/events'][2], 'little')} events until .300 s\n"


def spack_needs(recipe):
    """What a recipe depends on, read by a stand-in for Spack, which also asks for the options of CMake."""
    needs, package, builtin = set(), types.ModuleType("spack.package"), types.ModuleType("cmake")
    package.version = package.conflicts = lambda *_words, **_more: None
    package.depends_on = lambda spec, **_more: needs.add(re.split("[@+]", spec)[0])
    builtin.CMakePackage = type("CMakePackage", (), {"define": lambda _self, name, value: f"-D{name}={value}"})
    modules = {"spack.package": package, "spack_repo.builtin.build_systems.cmake": builtin}
    for name in ("spack", "spack_repo", "spack_repo.builtin", "spack_repo.builtin.build_systems"):
        modules[name] = types.ModuleType(name)
    with patch.dict(sys.modules, modules):
        scope = {"__name__": "package"}
        exec(compile(recipe, "package.py", "exec"), scope)
        assert scope["Razy"]().cmake_args() == ["-DRAZY_TESTS=False"]
    return needs


def test_recipes_ask_for_what_setup_and_python_ask_for():
    recipes = SOURCE / "docs" / "packaging"
    wanted = set()
    for line in re.findall(r"\|\| echo ([\w -]+)$", (SOURCE / "setup.sh").read_text(), flags=re.MULTILINE):
        wanted |= set(line.split()) - {"make"}
    assert {"gfortran", "libarpack2-dev", "python3-venv"} <= wanted
    for name in ("Dockerfile", "razy.def"):
        assert wanted <= set((recipes / name).read_text().split()), wanted - set((recipes / name).read_text().split())
    project = tomllib.loads((SOURCE / "post" / "pyproject.toml").read_text())["project"]
    wheel = tomllib.loads((SOURCE / "pyproject.toml").read_text())["project"]
    assert wheel == project | {"readme": "post/README.md"}
    python = {re.split("[<>=]", name)[0] for name in project["dependencies"]}
    spack, conda = (recipes / "spack" / "package.py").read_text(), (recipes / "conda" / "meta.yaml").read_text()
    assert {"mpi", "hdf5", "lapack", "blas", "arpack-ng"} <= spack_needs(spack)
    for name in python:
        assert f'"{name}"' in spack and re.search(rf"- {name}(-base)?\n", conda), name
    assert f'version: "{os.environ["RAZY_VERSION"]}"' in conda


def test_a_folder_with_a_blank_in_its_name(folder):
    """HDF5's compiler wrapper splits such names."""
    done = run(
        os.environ["RAZY_CMAKE"], "-S", SOURCE, "-B", folder / "a b", "-DRAZY_TESTS=OFF", "-DCMAKE_BUILD_TYPE=Release",
        f"-DCMAKE_Fortran_COMPILER={os.environ['RAZY_FORTRAN']}",
    )  # fmt: skip
    assert "Generating done" in done
    settings = (folder / "a b" / "CMakeCache.txt").read_text()
    assert "NOTFOUND" not in "".join(line for line in settings.splitlines() if line.startswith("HDF5_hdf5"))
