"""What counts as an executable statement, and what does not."""

from __future__ import annotations

import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "support"))

from count_statements import executable_statements

NONE = """\
!! call a comment
module razy_core_a
   use, intrinsic :: iso_fortran_env, only: real64
   implicit none(type, external)
   private
   public :: twice
   integer, parameter :: pair(2) = [1, 2]
   type, extends(b_t) :: a_t
      real(wp), allocatable :: x(:)
   contains
      procedure, private :: f => g
   end type a_t
contains
   pure real(wp) function f(self, &
                            other)
      class(a_t), intent(in) :: self
      procedure(h), pointer :: other
   end function f
end module razy_core_a
"""
EACH_ONE = [
    "x = 1",
    "call f(x); ",
    "text = 'a; b ! c'",
    "call f(x, &\n      ! between\n   &  y)",
    "if (a) return",
    "else if (b) then",
    "type is (integer)",
    "allocate (real(wp) :: x(3))",
    "do i = 1, 3",
]


class Count(unittest.TestCase):
    def count(self, files: dict[str, str]) -> int:
        """The number in a tree of these files."""
        with tempfile.TemporaryDirectory() as folder:
            for name, text in files.items():
                (Path(folder) / name).parent.mkdir(parents=True, exist_ok=True)
                (Path(folder) / name).write_text(text, encoding="utf-8")
            return executable_statements(Path(folder))

    def test_what_counts(self):
        self.assertEqual(self.count({"src/core/a.f90": NONE}), 0)
        for text in EACH_ONE:
            with self.subTest(text=text):
                self.assertEqual(self.count({"src/core/a.f90": f"{NONE}{text}\nend\n"}), 1)
        self.assertEqual(self.count({"src/core/a.f90": "a = 1; b = 2\nend do; enddo; end if\n"}), 2)
        self.assertEqual(self.count({"src/io/a.c": "/* a; */ f(x); // g();\n", "drivers/b.f90": "a = 1\n"}), 1)


if __name__ == "__main__":
    unittest.main()
