"""Each way in which a .pf file can be wrong is an error with the right line, and what is right is translated."""

from __future__ import annotations

import contextlib
import io
import tempfile
import unittest
from pathlib import Path

import pf_preprocess

SERIAL = """\
module sample
   use funit
   implicit none(type, external)
   integer :: counter = 0
contains
   @test
   subroutine test_one()
      integer :: t
      t = 1
      @assertEqual(1, t)
   end subroutine test_one
end module sample
"""
MPI = """\
module sample
   use pfunit
   implicit none(type, external)
contains
   @test(npes=[1, 2])
   subroutine test_one(this)
      class(MpiTestMethod), intent(inout) :: this
      @assertEqual(0, 0)
   end subroutine test_one
end module sample
"""
FIXTURE = """\
module sample
   use funit
   implicit none(type, external)
   @testCase
   type, extends(TestCase) :: gear_case
   end type gear_case
contains
   @test
   subroutine test_one(this)
      class(gear_case), intent(inout) :: this
      @assertEqual(0, 0)
   end subroutine test_one
end module sample
"""

# (source, text, what takes its place, line of the error, part of its reason)
REFUSED = [
    # procedures that pFUnit would drop
    (SERIAL, "subroutine test_one()", "recursive subroutine test_one()", 6, "plain 'subroutine name(…)'"),
    (SERIAL, "subroutine test_one()", "pure subroutine test_one()", 6, "plain 'subroutine name(…)'"),
    (SERIAL, "subroutine test_one()", "subroutine test_one( &\n   )", 6, "plain 'subroutine name(…)'"),
    (SERIAL, "subroutine test_one()", "subroutine test_one() ! first", 6, "plain 'subroutine name(…)'"),
    (SERIAL, "subroutine test_one()", "subroutine test_one", 6, "plain 'subroutine name(…)'"),
    (SERIAL, "   @test\n", "   @test\n\n", 6, "plain 'subroutine name(…)'"),
    (SERIAL, "   @test\n", "   @test\n   @disable\n\n", 7, "plain 'subroutine name(…)'"),
    (SERIAL, "   @test\n", "   @disable\n", 6, "@disable stands on the line after @test"),
    (SERIAL, "   @test\n", "   @disable\n   @test\n", 6, "@disable stands on the line after @test"),
    (SERIAL, "   @test\n", "\n", 12, "no @test in this file"),
    (
        FIXTURE,
        "contains\n",
        "contains\n@before\nsubroutine b()\nend subroutine b\n",
        8,
        "ignored in a file with @testCase",
    ),
    (
        FIXTURE,
        "contains\n",
        "contains\n@after\nsubroutine b()\nend subroutine b\n",
        8,
        "ignored in a file with @testCase",
    ),
    (FIXTURE, "   @test\n", "   @test\n   @disable\n", 9, "disables nothing in a file with @testCase"),
    (
        SERIAL,
        "contains\n",
        "contains\n@before\npure subroutine b()\nend subroutine b\n",
        6,
        "plain 'subroutine name(…)'",
    ),
    (SERIAL, "contains\n", "contains\n" + 2 * "@after\nsubroutine b()\nend subroutine b\n", 9, "only one @after"),
    # form of a directive
    (SERIAL, "@assertEqual(1, t)", f"@assertEqual(1, t, message='{'m' * 90}')", 10, "at most 120 characters"),
    (SERIAL, "@assertEqual(1, t)", "@assertEqual(1, &\n         t)", 10, "no continuation"),
    (SERIAL, "@assertEqual(1, t)", "@assertEqual(1, t) ! one", 10, "nothing may follow a directive"),
    (SERIAL, "@assertEqual(1, t)", "if (t > 0) @assertEqual(1, t)", 10, "stands alone on its line"),
    (SERIAL, "@assertEqual(1, t)", "@assertEqual(1, t); t = 2", 10, "nothing may follow a directive"),
    (SERIAL, "   @test\n", "   @test ! first\n", 6, "nothing after it"),
    (SERIAL, "@assertEqual(1, t)", "@", 10, "a directive is @ and a name"),
    # directives and arguments outside the subset
    (SERIAL, "@assertEqual", "@assertEquals", 10, "@assertEquals is not one of the directives"),
    (SERIAL, "@assertEqual", "@mpiAssertEqual", 10, "@mpiAssertEqual is not one of the directives"),
    (SERIAL, "   @test\n", "   @suite\n   @test\n", 6, "@suite is not one of the directives"),
    (SERIAL, "   @test\n", "   @testParameter\n   @test\n", 6, "@testParameter is not one of the directives"),
    (SERIAL, "@assertEqual(1, t)", "@assertEqual(1)", 10, "needs 2 operand(s)"),
    (SERIAL, "@assertEqual(1, t)", "@assertEqual(1, message='one')", 10, "needs 2 operand(s)"),
    (SERIAL, "@assertEqual(1, t)", "@assertEqual(1, t, 'one')", 10, "may follow its 2 operand(s), not ''one''"),
    (SERIAL, "@assertEqual(1, t)", "@assertLessThan(1, t, tolerance=1)", 10, "not 'tolerance=1'"),
    (SERIAL, "@assertEqual(1, t)", "@assertEqual(1, t, message='a', message='b')", 10, "given twice"),
    (SERIAL, "@assertEqual(1, t)", "@assertRelativelyEqual(1, t)", 10, "needs tolerance="),
    (SERIAL, "@assertEqual(1, t)", "@assertFail()", 10, "needs 1 operand(s)"),
    (SERIAL, "@assertEqual(1, t)", "@assertTrue", 10, "arguments in parentheses"),
    (SERIAL, "   integer :: counter = 0\n", "#ifdef MPI\n", 4, "no preprocessor lines"),
    # the module
    (SERIAL, "module sample\n   use", "module other\n   use", 1, "one module 'sample'"),
    (SERIAL, "end module sample\n", "end module sample\nmodule second\nend module second\n", 12, "only one module"),
    (SERIAL, "end module sample\n", "end module sample\nsubroutine s()\nend subroutine s\n", 14, "nothing after it"),
    (SERIAL, "   integer :: counter = 0\n", "   private\n", 4, "no 'private'"),
    (SERIAL, "   integer :: counter = 0\n", "   private :: x\n", 4, "no 'private'"),
    (SERIAL, "   use funit\n", "\n", 1, "needs 'use funit'"),
    (SERIAL, "   use funit\n", "   use funit, only: TestCase\n", 2, "takes no only: list"),
    # names of generated code
    *[(SERIAL, "counter", name, 4, f"'{name}' collides") for name in ("t", "suite", "run", "catch", "not", "Stub")],
    (SERIAL, "integer :: counter = 0", "real :: x(2, max(1, 2)) = [1, 2], initialize", 4, "'initialize' collides"),
    (SERIAL, "integer :: counter = 0", "integer finalize", 4, "'finalize' collides"),
    (SERIAL, "integer :: counter = 0", "integer :: counter, &\n      stub", 4, "'stub' collides"),
    (SERIAL, "   use funit\n", "   use funit\n   use razy_motion, only: step, run\n", 3, "'run' collides"),
    (SERIAL, "   use funit\n", "   use funit\n   use razy_motion, only: run => go\n", 3, "'run' collides"),
    (
        SERIAL,
        "end module sample",
        "   subroutine run()\n   end subroutine run\nend module sample",
        12,
        "'run' collides",
    ),
    (SERIAL, "end module sample", "pure real function t(x)\nend function t\nend module sample", 12, "'t' collides"),
    (SERIAL, "integer :: counter = 0", "type :: suite\n   end type suite", 4, "'suite' collides"),
    (SERIAL, "integer :: counter = 0", "interface run\n   end interface run", 4, "'run' collides"),
    (SERIAL, "counter", "sample_suite", 4, "'sample_suite' collides"),
    # ranks and fixtures
    (SERIAL, "   @test\n", "   @test(npes=[1])\n", 6, "npes needs 'use pfunit'"),
    (MPI, "@test(npes=[1, 2])", "@test", 5, "an MPI test names its ranks"),
    (MPI, "@test(npes=[1, 2])", "@test(npes=[1, 3])", 5, "npes=3 is more than MAX_PES=2"),
    (MPI, "@test(npes=[1, 2])", "@test(npes=[0])", 5, "at least 1"),
    (MPI, "@test(npes=[1, 2])", "@test(npes=ranks)", 5, "literal numbers"),
    (MPI, "test_one(this)\n", "test_one()\n", 5, "takes (this)"),
    (SERIAL, "test_one()\n", "test_one(this)\n", 6, "takes (this)"),
    (FIXTURE, "test_one(this)\n", "test_one()\n", 8, "takes (this)"),
    (FIXTURE, "   @testCase\n", "   @testCase\n\n", 4, "must be followed by"),
    (FIXTURE, "extends(TestCase)", "extends(MpiTestCase)", 4, "MpiTestCase needs 'use pfunit'"),
    (FIXTURE, "   @testCase\n", "   @testCase(npes=[1])\n", 4, "extends MpiTestCase"),
    (FIXTURE, "   end type gear_case\n", "   end type gear_case\n@testCase\n", 7, "only one @testCase"),
]


def translate(source: str, max_pes: int) -> tuple[int, str, str]:
    """Exit code, errors and the Fortran text of a file sample.pf with this source."""
    with tempfile.TemporaryDirectory() as folder:
        file, output = Path(folder, "sample.pf"), Path(folder, "sample.f90")
        file.write_text(source, encoding="utf-8")
        with contextlib.redirect_stderr(io.StringIO()) as errors:
            code = pf_preprocess.main([str(file), "--max-pes", str(max_pes), "--output", str(output)])
        text = output.read_text(encoding="utf-8") if output.exists() else ""
        return code, errors.getvalue().replace(str(file), "sample.pf"), text


class Refused(unittest.TestCase):
    def test_every_mistake(self):
        for source, text, replacement, line, reason in REFUSED:
            with self.subTest(replacement=replacement):
                self.assertEqual(source.count(text), 1, f"'{text}' must stand once in the source")
                code, errors, written = translate(source.replace(text, replacement), 2 if source == MPI else 0)
                self.assertEqual(code, 1)
                self.assertTrue(errors.startswith(f"sample.pf:{line}: error: "), errors)
                self.assertIn(reason, errors)
                self.assertEqual(written, "")

    def test_mpi_without_ranks(self):
        code, errors, _ = translate(MPI, 0)
        self.assertEqual(code, 1)
        self.assertIn("sample.pf:2: error: 'use pfunit' needs MAX_PES", errors)


class Accepted(unittest.TestCase):
    def test_plain_files(self):
        for source, max_pes in ((SERIAL, 0), (SERIAL, 2), (MPI, 2), (FIXTURE, 0)):
            code, errors, written = translate(source, max_pes)
            self.assertEqual((code, errors), (0, ""))
            self.assertIn("call test_one(", written)

    def test_names_below_the_module_are_free(self):
        inner = "   type :: part\n      private\n      integer :: run\n   end type part\n"
        code, errors, _ = translate(SERIAL.replace("   integer :: counter = 0\n", inner), 0)
        self.assertEqual((code, errors), (0, ""))

    def test_signs_in_strings_and_comments(self):
        for line in ("@assertEqual('(!@&', '(!@&')", "! @assertEqual(1, 2)", "t = 2 ! @test", "print *, '@'"):
            code, errors, _ = translate(SERIAL.replace("@assertEqual(1, t)", line), 0)
            self.assertEqual((code, errors), (0, ""))


if __name__ == "__main__":
    unittest.main()
