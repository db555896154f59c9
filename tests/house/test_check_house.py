"""Every rule of check_house.py is broken once in a small tree, and found on the right line; what is allowed is not."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

import check_house

GOOD = {
    "src/core/kinds.f90": """\
!! Use of stop or print in a comment is no breach, nor is a string.
module razy_core_kinds
   use, intrinsic :: iso_fortran_env, only: real64
   implicit none(type, external)
   private
   public :: wp
   integer, parameter :: wp = real64
   integer, dimension(0:1), parameter :: pair = [1, 2]
   character(*), parameter :: text = 'stop; print *, "use hdf5"'
   type :: stop_t
      private
      real(wp) :: print = 0.0_wp
   end type stop_t
   interface
      subroutine c_stop(code) bind(c)
         import
         integer, value :: code
      end subroutine c_stop
   end interface
contains
   real(wp) function travel(stop, unit)
      type(stop_t), intent(inout) :: stop(:)
      integer, intent(in) :: unit
      integer, parameter :: local = 1
      integer, allocatable :: list(:)
      class(*), allocatable :: any_thing
      stop(1)%print = 1.0_wp
      stop = stop_t(print=2.0_wp)
      stop (1) = stop_t()
      list = [integer :: 1, 2]
      write (unit, '(a)') 'stop'
      select type (any_thing)
      type is (integer)
         list = [integer :: ]
      class default
         list = [integer :: 3]
      end select
      travel = stop(1)%print
   end function travel
end module razy_core_kinds
""",
    "src/io/file.f90": """\
module razy_io_file
   use hdf5, only: hid_t
   use h5lt, only: h5ltmake_dataset_f
   use razy_core_kinds, only: wp
   implicit none (type, external)
   private
end module razy_io_file
""",
    "src/sweep/grid.f90": """\
module razy_sweep_grid
   use mpi_f08, only: MPI_Comm
   use razy_io_file, only: &
      wp
   use razy_io_extrema, only: extrema_t
   implicit none(type, external)
   private
end module razy_sweep_grid
""",
    "drivers/sweep.f90": """\
program razy_sweep
   use mpi_f08, only: MPI_COMM_WORLD
   use razy_sweep_grid, only: grid_t
   use razy_command_line, only: options_t
   implicit none(type, external)
   print *, 'done'
   stop 1
end program razy_sweep
""",
    "drivers/command_line.f90": """\
module razy_command_line
   implicit none(type, external)
   private
end module razy_command_line
""",
    "tests/core/CMakeLists.txt": "razy_add_test(core TEST_SOURCES core.pf)\n",
}

# (file, text, what takes its place, line of the breach, its rule)
KINDS, FILE, GRID, DRIVER = list(GOOD)[:4]
BAD = [
    (FILE, "use razy_core_kinds", "use razy_sweep_grid", 4, "layers: io must not use sweep"),
    (FILE, "use razy_core_kinds", "USE  RAZY_machine_model", 4, "layers: io must not use machine"),
    (
        KINDS,
        "   implicit none",
        "   use razy_linalg_solve, only: solve\n   implicit none",
        4,
        "layers: core must not use linalg",
    ),
    (
        KINDS,
        "contains\n",
        "contains\n   subroutine s()\n   use &\n razy_io_file, only: x\n",
        22,
        "layers: core must not use io",
    ),
    (
        KINDS,
        "   implicit none",
        "   use mpi_f08, only: MPI_Comm\n   implicit none",
        4,
        "layers: core must not use mpi_f08",
    ),
    (GRID, "use mpi_f08", "use hdf5", 2, "layers: sweep must not use hdf5"),
    (GRID, "use mpi_f08, only: MPI_Comm", "use h5lt, only: x", 2, "layers: sweep must not use h5lt"),
    (GRID, "use mpi_f08", "use mpi", 2, "layers: mpi is no module of this project"),
    (DRIVER, "use razy_command_line", "use razy_unknown_thing", 4, "layers: drivers must not use unknown"),
    (DRIVER, "use mpi_f08, only: MPI_COMM_WORLD", "use hdf5, only: hid_t", 2, "layers: drivers must not use hdf5"),
    (GRID, "only: MPI_Comm", "MPI_Comm => x", 2, "only: 'use mpi_f08'"),
    (KINDS, ", only: real64", "", 3, "only: 'use iso_fortran_env'"),
    (DRIVER, ", only: grid_t", "", 3, "only: 'use razy_sweep_grid'"),
    (
        FILE,
        "module razy_io_file\n   use",
        "module razy_io_files\n   use",
        1,
        "name: the path says 'module razy_io_file'",
    ),
    (
        FILE,
        "module razy_io_file\n   use",
        "program razy_io_file\n   use",
        1,
        "name: the path says 'module razy_io_file'",
    ),
    (FILE, "end module razy_io_file\n", "end module\nmodule second\nend module\n", 8, "unit: a file holds one"),
    (FILE, "module razy_io_file\n   use", "submodule (razy_io) file\n   use", 1, "unit: a file holds one"),
    (FILE, "none (type, external)", "none", 1, "implicit:"),
    (DRIVER, "   implicit none(type, external)\n", "", 1, "implicit:"),
    (FILE, "   private\n", "", 1, "private:"),
    (FILE, "   private\n", "   private :: wp\n", 1, "private:"),
    (KINDS, "   private\n   public", "   public", 2, "private:"),
    (KINDS, "contains\n", "   integer :: counter\ncontains\n", 20, "state: a module has no variables"),
    (KINDS, "contains\n", "   integer counter\ncontains\n", 20, "state: a module has no variables"),
    (
        KINDS,
        "contains\n",
        "   type(stop_t), allocatable, protected :: s\ncontains\n",
        20,
        "state: a module has no variables",
    ),
    (
        KINDS,
        "contains\n",
        "   procedure(f), pointer :: p => null()\ncontains\n",
        20,
        "state: a module has no variables",
    ),
    (KINDS, "integer, allocatable :: list(:)", "integer :: list(2) = [1, 2]", 25, "state: a value in the declaration"),
    (KINDS, "integer, allocatable :: list(:)", "integer, save :: list(2)", 25, "state: a value in the declaration"),
    (KINDS, "integer, allocatable :: list(:)", "save", 25, "state: 'save'"),
    (KINDS, "      stop(1)%print = 1.0_wp", "      stop", 27, "stop:"),
    (KINDS, "      stop(1)%print = 1.0_wp", "      if (unit == (1)) error stop 'no'", 27, "stop:"),
    (KINDS, "      stop(1)%print = 1.0_wp", "      list = 1; stop (1)", 27, "stop:"),
    (KINDS, "      stop(1)%print = 1.0_wp", "      call exit(1)", 27, "stop:"),
    (KINDS, "write (unit, '(a)')", "write (*, '(a)')", 31, "print:"),
    (KINDS, "write (unit, '(a)')", "write (unit=6, fmt='(a)')", 31, "print:"),
    (KINDS, "write (unit, '(a)') 'stop'", "if (unit > 0) print '(a)', 'x'", 31, "print:"),
    (KINDS, "write (unit, '(a)') 'stop'", "print *, 'x'", 31, "print:"),
    (KINDS, "only: real64", "only: real64, output_unit", 3, "print:"),
    (FILE, "only: hid_t", "only: hid_t" + " " * 120 + "! far", 2, "columns:"),
    ("tests/core/CMakeLists.txt", "razy_add_test", "add_pfunit_ctest", 1, "tests:"),
]

# A type with a component, and a user of it
PARENT = """\
module razy_core_a
implicit none(type, external)
private
public :: parent_t
type :: parent_t
integer :: mine = 0
end type parent_t
end module razy_core_a
"""
USER = """\
module razy_core_b
use razy_core_a, only: parent_t
implicit none(type, external)
private
contains
subroutine s(a, x)
{}
end subroutine s
end module razy_core_b
"""
EXTENDED = {
    "src/core/a.f90": PARENT.replace("integer :: mine = 0\n", ""),
    "src/core/b.f90": USER.replace(
        "contains", "type, extends(parent_t) :: child_t\nend type child_t\ncontains"
    ).replace("{}", "%s"),
}

# Files that may stand at the top level, some that may not, and output that .gitignore names
TOP_FILES = (".gitignore", ".ruff.toml", "CMakeLists.txt", "CMakePresets.json", "LICENSE", "README.md", "setup.sh")
TRIALS = ("fort.77", "trial/case.nml", "case.nml", ".cache/x", "build/x.o.txt")
IGNORED = ("build/a.o", "build-debug/src/a.txt", "a.h5", "post/a.h5", "tests/__pycache__/a.pyc")
LARGE = "x" * (check_house.MAX_BYTES + 1)


def top_breach(name: str) -> str:
    """What is said of a file that does not belong at the top level, or of its folder."""
    return f"{Path(name).parts[0]}:1: tree: does not belong at the top level"


def write(folder: str, tree: dict[str, str]) -> None:
    """Make these files."""
    for name, text in tree.items():
        file = Path(folder, name)
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")


def breaches(tree: dict[str, str]) -> list[str]:
    """What check_house says of a tree of these files."""
    with tempfile.TemporaryDirectory() as folder:
        write(folder, tree)
        return check_house.check_tree(Path(folder))


def breaches_of_clone(tracked: dict[str, str], untracked: dict[str, str]) -> list[str]:
    """The same of a clone in which git tracks the first of them only."""
    free = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    with tempfile.TemporaryDirectory() as folder:
        write(folder, tracked)
        for command in (["init", "--quiet"], ["add", "--force", "."]):
            subprocess.run(["git", "-C", folder, *command], check=True, env=free)
        write(folder, untracked)
        return check_house.check_tree(Path(folder))


class CheckHouse(unittest.TestCase):
    def test_allowed(self):
        self.assertEqual(breaches(GOOD), [])

    def test_every_breach(self):
        for name, text, replacement, line, rule in BAD:
            with self.subTest(replacement=replacement):
                self.assertEqual(GOOD[name].count(text), 1, f"'{text}' must stand once in {name}")
                found = breaches(GOOD | {name: GOOD[name].replace(text, replacement)})
                self.assertEqual(len(found), 1, found)
                self.assertTrue(found[0].startswith(f"{name}:{line}: {rule}"), found[0])

    def test_every_pair_of_layers(self):
        order = list(check_house.LAYERS)
        for folder, allowed in check_house.LAYERS.items():
            self.assertFalse([below for below in allowed if order.index(below) >= order.index(folder)])
            for used in order:
                text = (
                    f"module razy_{folder}_a\nuse razy_{used}_b, only: c\n"
                    "implicit none(type, external)\nprivate\nend module\n"
                )
                found = breaches({f"src/{folder}/a.f90": text, f"tests/{folder}/test_a.pf": ""})
                self.assertEqual(found == [], used == folder or used in allowed, found)

    def test_number_of_files(self):
        def tree(count):
            names = [f"m{i}" for i in range(count)]
            text = "module razy_core_{}\nimplicit none(type, external)\nprivate\nend module\n"
            return {f"src/core/{name}.f90": text.format(name) for name in names}

        self.assertEqual(breaches(tree(check_house.MAX_FILES)), [])
        found = breaches(tree(check_house.MAX_FILES + 1))
        self.assertEqual(found, ["src/core:1: folder: 21 files, more than 20"])

    def test_tests_of_the_hybrid_system(self):
        text = "module razy_hybrid_a\nimplicit none(type, external)\nprivate\nend module\n"
        found = breaches({"src/hybrid/a.f90": text})
        self.assertEqual(found, ["src/hybrid/a.f90:1: tests: there is no tests/hybrid/test_a.pf"])
        self.assertEqual(breaches({"src/hybrid/a.f90": text, "tests/hybrid/test_a.pf": ""}), [])

    def test_extended_types(self):
        for line, allowed in {
            "class(parent_t), intent(in) :: self": False,
            "class(child_t), intent(in) :: other": False,
            "class(parent_t), intent(in) :: other": True,
        }.items():
            self.assertEqual(breaches(EXTENDED | {"src/core/b.f90": EXTENDED["src/core/b.f90"] % line}) == [], allowed)
        deferred = EXTENDED["src/core/a.f90"].replace("end type", "contains\nprocedure(f), deferred :: f\nend type")
        used = EXTENDED["src/core/b.f90"] % "class(parent_t), intent(in) :: self"
        self.assertEqual(breaches({"src/core/a.f90": deferred, "src/core/b.f90": used}), [])

    def test_components(self):
        for use, allowed in {
            "x = a%mine": False,
            "x = a%yours": True,
            "a = parent_t(yours=1)": True,
            "a = parent_t(1)": True,
            "type(parent_t) :: yours": False,
        }.items():
            found = breaches({"src/core/a.f90": PARENT.replace("mine", "yours"), "src/core/b.f90": USER.format(use)})
            self.assertEqual(found == [], allowed, use)
        for hidden in (
            "integer, private :: mine",
            "private\ninteger :: mine",
            "integer, allocatable, private :: mine(:)",
        ):
            self.assertEqual(breaches({"src/core/a.f90": PARENT.replace("integer :: mine", hidden)}), [])
        found = breaches({"src/core/a.f90": PARENT})
        self.assertEqual(found, ["src/core/a.f90:6: private: no other file mentions mine of parent_t"])
        self.assertEqual(breaches({"src/core/a.f90": PARENT.replace("public :: parent_t\n", "")}), [])

    def test_unknown_folder(self):
        text = "module razy_odd_a\nimplicit none(type, external)\nprivate\nend module\n"
        self.assertEqual(
            breaches({"src/odd/a.f90": text}), ["src/odd/a.f90:1: layers: 'odd' is no folder of the table of layers"]
        )

    def test_what_may_stand_at_the_top_level(self):
        self.assertEqual(breaches(GOOD | dict.fromkeys(TOP_FILES, "")), [])
        for name in TRIALS:
            with self.subTest(name=name):
                self.assertEqual(breaches(GOOD | {name: ""}), [top_breach(name)])

    def test_ignored_output_without_git(self):
        ignore = {".gitignore": "/build*/\n__pycache__/\n*.h5\n"}
        self.assertEqual(breaches(GOOD | ignore | dict.fromkeys(IGNORED, LARGE)), [])
        for name in ("build", "tests/build-x/a", "run.h5.txt", "src/h5"):
            with self.subTest(name=name):
                self.assertEqual(len(breaches(GOOD | ignore | {name: LARGE})), 1 + (len(Path(name).parts) == 1))

    @unittest.skipUnless(shutil.which("git"), "no git")
    def test_what_git_tracks(self):
        ignore = {".gitignore": "/build*/\n"}
        self.assertEqual(breaches_of_clone(GOOD | ignore, {"fort.77": LARGE, "bench/trial.txt": LARGE}), [])
        for name in TRIALS:
            with self.subTest(name=name):
                self.assertEqual(breaches_of_clone(GOOD | ignore | {name: ""}, {}), [top_breach(name)])

    def test_large_files(self):
        allowed = "x" * check_house.MAX_BYTES
        self.assertEqual(breaches(GOOD | {"tests/data.txt": allowed}), [])
        found = [f"tests/data.txt:1: size: {len(LARGE)} bytes, more than {len(allowed)}"]
        self.assertEqual(breaches(GOOD | {"tests/data.txt": LARGE}), found)
        if shutil.which("git"):
            self.assertEqual(breaches_of_clone(GOOD | {"tests/data.txt": LARGE}, {}), found)
        self.assertEqual(len(breaches(GOOD | {"fort.77": LARGE})), 2)

    def test_empty_tree(self):
        self.assertIn("no Fortran file in src/", breaches({})[0])


if __name__ == "__main__":
    unittest.main()
