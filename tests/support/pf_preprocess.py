"""Translate a test file in pFUnit's syntax (.pf) into Fortran, or write the program that runs translated files.

Only a subset of the directives is understood. Whatever the real pFUnit would drop or mistake without a word is an
error here: `file:line: error: reason` on standard error, exit code 1.
"""

from __future__ import annotations

import argparse
import re
import sys
from dataclasses import dataclass, field
from pathlib import Path

from fortran_source import blank_strings, statements

MAX_DIRECTIVE = 120
GENERATED_NAMES = {"t", "suite", "run", "catch", "not", "initialize", "finalize", "stub"}


@dataclass(frozen=True)
class Assertion:
    """How a directive becomes a call of a procedure of module funit."""

    procedure: str
    operands: int
    compared: bool = False
    extra: str = ""
    keywords: tuple[str, ...] = ("message",)
    required: tuple[str, ...] = ()


ASSERTIONS = {
    "assertequal": Assertion("assert_close", 2, True, "relative=.false.", ("tolerance", "message")),
    "assertrelativelyequal": Assertion(
        "assert_close", 2, True, "relative=.true.", ("tolerance", "message"), required=("tolerance",)
    ),
    "assertlessthan": Assertion("assert_order", 2, True, "relation='<'"),
    "assertlessthanorequal": Assertion("assert_order", 2, True, "relation='<='"),
    "assertgreaterthan": Assertion("assert_order", 2, True, "relation='>'"),
    "assertgreaterthanorequal": Assertion("assert_order", 2, True, "relation='>='"),
    "asserttrue": Assertion("assert_condition", 1, extra="expected=.true."),
    "assertfalse": Assertion("assert_condition", 1, extra="expected=.false."),
    "assertisnan": Assertion("assert_nan", 1),
    "assertisfinite": Assertion("assert_finite", 1),
    "assertfail": Assertion("assert_never", 1, keywords=()),
}

PLAIN_SUBROUTINE = re.compile(r"\s*subroutine\s+(\w+)\s*\(\s*(\w*)\s*\)\s*$", re.IGNORECASE)
FIXTURE_TYPE = re.compile(r"\s*type\s*,\s*extends\s*\(\s*(TestCase|MpiTestCase)\s*\)\s*::\s*(\w+)\s*$", re.IGNORECASE)
PROCEDURE = re.compile(r"(?!end\b)(?:[\w()*=, ]+\s)?(?:subroutine|function)\s+(\w+)\b", re.IGNORECASE)
END_PROCEDURE = re.compile(r"end\s*(subroutine|function)\b|end$", re.IGNORECASE)
USE = re.compile(r"use\b\s*(?:,\s*(?:non_)?intrinsic\s*)?(?:::)?\s*(\w+)\s*(?:,(.*))?$", re.IGNORECASE)
TYPE_DEFINITION = re.compile(r"type\b(?!\s*\()[^:]*?(?:::\s*|\s)(\w+)\s*$", re.IGNORECASE)
DECLARATION = re.compile(
    r"(?:[^:]*::|(?:integer|real|logical|character|complex)\b(?:\s*\([^)]*\))?(?:\s*\*\s*\d+)?)(.*)", re.IGNORECASE
)
KEYWORD = re.compile(r"(\w+)\s*=(?!=)")
INTERFACE = re.compile(r"(?:abstract\s+)?interface\b\s*(\w*)", re.IGNORECASE)


class PfError(Exception):
    """A file that is refused: the line (from 1) and the reason."""

    def __init__(self, line: int, reason: str):
        super().__init__(reason)
        self.line = line
        self.reason = reason


@dataclass
class Test:
    """One `@test`: its procedure, the line of the directive and the numbers of ranks (none for a serial test)."""

    name: str
    line: int
    npes: list[int]
    disabled: bool


@dataclass
class Suite:
    """What a file holds: its module, its tests and what surrounds each of them."""

    module: str
    mpi: bool = False
    tests: list[Test] = field(default_factory=list)
    before: tuple[str, str] | None = None
    after: tuple[str, str] | None = None
    fixture: str | None = None


def declared_names(entities: str) -> list[str]:
    """Names in the list of entities of a declaration, without their shapes and values."""
    bare = ""
    while bare != entities:
        bare, entities = entities, re.sub(r"\([^()]*\)|\[[^\[\]]*\]", "", entities)
    return [re.split(r"[=*\s]", item.strip())[0] for item in bare.split(",")]


def split_arguments(text: str, line: int) -> list[str]:
    """The comma-separated arguments of `(…)`, which must be all of the text."""
    if not text.startswith("("):
        raise PfError(line, "a directive is its name and arguments in parentheses")
    code = blank_strings(text)
    depth, start, arguments = 0, 1, []
    for at, char in enumerate(code):
        if char in "([":
            depth += 1
        elif char in ")]":
            depth -= 1
        if (char == "," and depth == 1) or depth == 0:
            arguments.append(text[start:at].strip())
            start = at + 1
        if depth == 0:
            if text[start:].strip():
                raise PfError(line, "nothing may follow a directive, not even a comment")
            return arguments
    raise PfError(line, "a directive is one line: no continuation, no comment inside")


def parse_npes(text: str, line: int) -> list[int]:
    """Ranks of `(npes=[1,2])`; an empty text names none."""
    if not text:
        return []
    match = re.fullmatch(r"\(\s*npes\s*=\s*\[\s*(\d+(?:\s*,\s*\d+)*)\s*\]\s*\)", text, re.IGNORECASE)
    if not match:
        raise PfError(line, "only (npes=[…]) with literal numbers may follow, and nothing after it")
    npes = [int(number) for number in match[1].split(",")]
    if min(npes) < 1:
        raise PfError(line, "npes is at least 1")
    return npes


def assertion(name: str, text: str, line: int, file: str) -> list[str]:
    """Fortran lines of the assertion `name` with the arguments `text`."""
    rule = ASSERTIONS[name.lower()]
    arguments = split_arguments(text, line)
    operands, options = arguments[: rule.operands], arguments[rule.operands :]
    if len(operands) < rule.operands or any(not item or KEYWORD.match(item) for item in operands):
        raise PfError(line, f"@{name} needs {rule.operands} operand(s), without keywords")
    given = []
    for option in options:
        match = KEYWORD.match(option)
        if not match or match[1].lower() not in rule.keywords:
            allowed = " and ".join(f"{keyword}=" for keyword in rule.keywords) or "nothing"
            raise PfError(line, f"@{name}: {allowed} may follow its {rule.operands} operand(s), not '{option}'")
        given.append(match[1].lower())
    if len(set(given)) < len(given):
        raise PfError(line, f"@{name}: a keyword is given twice")
    for keyword in set(rule.required) - set(given):
        raise PfError(line, f"@{name} needs {keyword}=")
    if rule.compared:
        operands = [f"pf_values({operand})" for operand in operands]
    passed = [*operands, *([rule.extra] if rule.extra else []), *options]
    return [
        f"call {rule.procedure}( &",
        *(f"{argument}, &" for argument in passed),
        f"location=SourceLocation('{file}', {line}))",
        "if (anyExceptions()) return",
    ]


class Translator:
    """Reads one file; `translate` gives its module in Fortran, and `suite` is what it holds."""

    def __init__(self, path: Path, max_pes: int):
        self.path = path
        self.max_pes = max_pes
        self.lines = path.read_text(encoding="utf-8").splitlines()
        self.suite = Suite(path.stem)
        self.fixture_npes: list[int] = []
        self.fixture_mpi = False

    def translate(self) -> list[str]:
        """The module with its assertions written out, each line under the number it has in the .pf file."""
        self.check_module()
        self.read_fixture()
        out = [f'# 1 "{self.path}"']
        for number, line in enumerate(self.lines, 1):
            if not line.lstrip().startswith("@"):
                if "@" in blank_strings(line):
                    raise PfError(number, "a directive stands alone on its line")
                out.append(line)
                continue
            for generated in self.directive(number, line):
                out.extend((f'# {number} "{self.path}"', generated))
            out.append(f'# {number + 1} "{self.path}"')
        if not self.suite.tests:
            raise PfError(len(self.lines), "no @test in this file")
        return out

    def directive(self, number: int, line: str) -> list[str]:
        """Act on the directive of this line; the Fortran lines that take its place."""
        if len(line.rstrip()) > MAX_DIRECTIVE:
            raise PfError(number, f"a directive has at most {MAX_DIRECTIVE} characters")
        match = re.fullmatch(r"@(\w+)\s*(.*)", line.strip())
        if not match:
            raise PfError(number, "a directive is @ and a name")
        name, rest = match[1].lower(), match[2]
        if name in ASSERTIONS:
            return assertion(match[1], rest, number, self.path.name)
        if name == "test":
            self.add_test(number, parse_npes(rest, number))
        elif name in ("before", "after", "disable") and rest:
            raise PfError(number, f"nothing may follow @{name}")
        elif name in ("before", "after"):
            self.add_surrounding(number, name)
        elif name == "disable":
            if number < 2 or not re.match(r"\s*@test\b", self.lines[number - 2], re.IGNORECASE):
                raise PfError(number, "@disable stands on the line after @test")
            if self.suite.fixture:
                raise PfError(number, "@disable disables nothing in a file with @testCase")
        elif name != "testcase":
            raise PfError(number, f"@{match[1]} is not one of the directives in use here")
        return []

    def line_after(self, number: int) -> str:
        """The line that follows line `number`, empty at the end of the file."""
        return self.lines[number] if number < len(self.lines) else ""

    def plain_subroutine(self, number: int, directive: str) -> tuple[str, str]:
        """Name and argument of the subroutine on the line after `number`."""
        match = PLAIN_SUBROUTINE.match(self.line_after(number))
        if not match:
            raise PfError(number, f"{directive} must be followed at once by a plain 'subroutine name(…)' on one line")
        return match[1], match[2]

    def read_fixture(self) -> None:
        """Find `@testCase` first: what other directives mean depends on it."""
        for number, line in enumerate(self.lines, 1):
            match = re.match(r"\s*@testcase\b\s*(.*)", line, re.IGNORECASE)
            if not match:
                continue
            if self.suite.fixture:
                raise PfError(number, "only one @testCase in a file")
            fixture = FIXTURE_TYPE.match(self.line_after(number))
            if not fixture:
                raise PfError(number, "@testCase must be followed by 'type, extends(TestCase) :: name', or MpiTestCase")
            self.suite.fixture = fixture[2]
            self.fixture_npes = parse_npes(match[1].strip(), number)
            self.fixture_mpi = fixture[1].lower() == "mpitestcase"
            if self.fixture_mpi and not self.suite.mpi:
                raise PfError(number, "MpiTestCase needs 'use pfunit'")
            if self.fixture_npes and not self.fixture_mpi:
                raise PfError(number, "npes needs a type that extends MpiTestCase")

    def add_test(self, number: int, npes: list[int]) -> None:
        """Take the test whose `@test` stands on line `number`."""
        disabled = bool(re.match(r"\s*@disable\s*$", self.line_after(number), re.IGNORECASE))
        name, argument = self.plain_subroutine(number + disabled, "@test")
        if npes and self.suite.fixture and not self.fixture_mpi:
            raise PfError(number, "npes needs a fixture that extends MpiTestCase")
        if npes and not self.suite.mpi:
            raise PfError(number, "npes needs 'use pfunit'")
        npes = npes or self.fixture_npes
        if self.suite.mpi and not npes and (argument or self.fixture_mpi):
            raise PfError(number, "an MPI test names its ranks: @test(npes=[…])")
        if max(npes, default=0) > self.max_pes:
            raise PfError(number, f"npes={max(npes)} is more than MAX_PES={self.max_pes}")
        if bool(argument) != bool(npes or self.suite.fixture):
            raise PfError(number, f"'{name}' takes (this) if it is an MPI test or has a fixture, and nothing otherwise")
        self.suite.tests.append(Test(name, number, npes, disabled))

    def add_surrounding(self, number: int, which: str) -> None:
        """Take the subroutine under `@before` or `@after`."""
        if self.suite.fixture:
            raise PfError(number, f"@{which} is ignored in a file with @testCase: use setUp and tearDown")
        if getattr(self.suite, which):
            raise PfError(number, f"only one @{which} in a file")
        setattr(self.suite, which, self.plain_subroutine(number, f"@{which}"))

    def check_module(self) -> None:
        """One module, named as the file, open to the generated code, without names the generated code uses."""
        for number, line in enumerate(self.lines, 1):
            if line.startswith("#"):
                raise PfError(number, "no preprocessor lines in a test file")
        code = statements(self.lines)
        first = re.fullmatch(r"module\s+(\w+)", code[0][1], re.IGNORECASE) if code else None
        if not first or first[1].lower() != self.path.stem.lower():
            raise PfError(
                code[0][0] if code else 1, f"the file must hold one module '{self.path.stem}', as it is named"
            )
        if not re.match(r"end\s*module\b", code[-1][1], re.IGNORECASE):
            raise PfError(code[-1][0], "the file must hold one module and nothing after it")
        frameworks = self.check_specification(code[1:-1])
        if not frameworks:
            raise PfError(code[0][0], "the module needs 'use funit', or 'use pfunit' for MPI tests")
        self.suite.mpi = "pfunit" in frameworks
        if self.suite.mpi and not self.max_pes:
            raise PfError(frameworks["pfunit"], "'use pfunit' needs MAX_PES in the call of add_pfunit_ctest")

    def check_specification(self, code: list[tuple[int, str]]) -> dict[str, int]:
        """Check what is declared at the module's own level; the frameworks used and their lines."""
        frameworks, depth, closing = {}, 0, ""
        contained = False
        for number, text in code:
            lower = text.lower()
            names: list[str] = []
            if re.match(r"end\s*module\b|module\s+\w+$|program\b", lower):
                raise PfError(number, "only one module in a file")
            if contained:
                if END_PROCEDURE.match(lower):
                    depth -= 1
                elif match := PROCEDURE.match(text):
                    names = [match[1]] if depth == 0 else []
                    depth += 1
            elif closing:
                closing = "" if re.match(rf"end\s*{closing}\b", lower) else closing
            elif lower == "contains":
                contained = True
            elif match := USE.match(text):
                rest = (match[2] or "").strip()
                if match[1].lower() in ("funit", "pfunit"):
                    if rest:
                        raise PfError(number, f"'use {match[1]}' takes no only: list, generated code needs all of it")
                    frameworks[match[1].lower()] = number
                elif only := re.match(r"only\s*:(.*)", rest, re.IGNORECASE):
                    names = [item.split("=>")[0].strip() for item in only[1].split(",")]
            elif re.match(r"private\b", lower):
                raise PfError(number, "no 'private' in a test module: generated code uses its names")
            elif match := INTERFACE.match(text):
                names, closing = [match[1]], "interface"
            elif match := TYPE_DEFINITION.match(text):
                names, closing = [match[1]], "type"
            elif match := DECLARATION.match(text):
                names = declared_names(match[1])
            for name in names:
                if name.lower() in GENERATED_NAMES | {f"{self.suite.module.lower()}_suite"}:
                    raise PfError(number, f"'{name}' collides with a name in generated code")
        return frameworks

    def runner(self) -> list[str]:
        """The module that runs the tests one after the other."""
        suite = self.suite
        names = {test.name for test in suite.tests if not test.disabled}
        names |= {item[0] for item in (suite.before, suite.after) if item and names}
        names |= {suite.fixture} if suite.fixture and names else set()
        imports = [f"   use {suite.module}, only: {name}" for name in sorted(names)]
        calls, cases = [], []
        for test in suite.tests:
            for npes in test.npes or [0]:
                if test.disabled:
                    calls.append("      call skip_test()")
                    continue
                case = f"{suite.module}_case_{len(cases) + 1}"
                calls.append(f"      call {case}()")
                cases.append([f"   subroutine {case}()", *self.case(test, npes), f"   end subroutine {case}", ""])
        return [
            f"module {suite.module}_runner",
            f"   use {'pfunit' if self.max_pes else 'funit'}",
            *imports,
            "   implicit none(type, external)",
            "   private",
            f"   public :: {suite.module}_run",
            "contains",
            f"   subroutine {suite.module}_run()",
            *calls,
            f"   end subroutine {suite.module}_run",
            "",
            *(line for case in cases for line in case),
            f"end module {suite.module}_runner",
        ]

    def case(self, test: Test, npes: int) -> list[str]:
        """Body of the subroutine that runs one test, on `npes` ranks or (0) serially."""
        suite, full_name = self.suite, f"{self.suite.module}_suite.{test.name}"
        this = "this" if npes or suite.fixture else ""
        before = f"{suite.before[0]}({this if suite.before[1] else ''})" if suite.before else ""
        after = f"{suite.after[0]}({this if suite.after[1] else ''})" if suite.after else ""
        if suite.fixture:
            before, after = "this%setUp()", "this%tearDown()"
        body = [
            *([f"call {before}"] if before else []),
            "if (.not. anyExceptions()) then",
            f"   call {test.name}({this})",
            *([f"   call {after}"] if after else []),
            "end if",
        ]
        declared = [f"type({suite.fixture or 'MpiTestMethod'}) :: this"] if this else []
        if npes:
            where = f"SourceLocation('{self.path.name}', {test.line})"
            declared.append("logical :: active")
            begin = [f"call begin_mpi_test(this, '{full_name}', {npes}, &", f"   {where}, active)"]
            body = ["if (active) then", *(f"   {line}" for line in body), "end if"]
            end = "call end_mpi_test(this)"
        else:
            begin, end = (
                [f"call begin_test('{full_name}')"],
                f"call {'end_shared_test' if self.max_pes else 'end_test'}()",
            )
        return [f"      {line}" for line in (*declared, *begin, *body, end)]


def driver(name: str, modules: list[str], mpi: bool) -> list[str]:
    """The program that runs the suites of these modules."""
    framework = "pfunit, only: begin_mpi, end_mpi, has_failed" if mpi else "funit, only: has_failed, print_summary"
    return [
        f"program {name}_driver",
        f"   use {framework}",
        *(f"   use {module}_runner, only: {module}_run" for module in modules),
        "   implicit none(type, external)",
        "",
        *(["   call begin_mpi()"] if mpi else []),
        *(f"   call {module}_run()" for module in modules),
        f"   call {'end_mpi' if mpi else 'print_summary'}()",
        "   if (has_failed()) stop 2, quiet=.true.",
        f"end program {name}_driver",
    ]


def main(arguments: list[str] | None = None) -> int:
    """Command line; see --help."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sources", nargs="+", type=Path, help="the .pf file, or with --driver all of a program's")
    parser.add_argument("--driver", metavar="NAME", help="write the program of this name instead of a module")
    parser.add_argument("--max-pes", type=int, default=0, help="ranks the program runs on; 0: without MPI")
    parser.add_argument("--output", type=Path, required=True)
    args = parser.parse_args(arguments)
    if args.driver:
        lines = driver(args.driver, [source.stem for source in args.sources], args.max_pes > 0)
    else:
        (source,) = args.sources
        translator = Translator(source, args.max_pes)
        try:
            lines = [*translator.translate(), f'# 1 "{source.stem}_runner"', *translator.runner()]
        except PfError as error:
            print(f"{source}:{error.line}: error: {error.reason}", file=sys.stderr)
            return 1
    args.output.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
