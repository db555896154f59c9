"""The rules of the house that neither compiler nor linter checks; one line for every breach, exit code 1 if any.

A folder of src/ uses only the folders LAYERS gives it (the table of docs/architecture.md); only sweep and the drivers
know MPI, only io knows HDF5. Path and module name agree, `use` says what it takes, a module is private and has no
variables, the library neither stops nor prints. A folder holds no more than MAX_FILES files, each module of the
hybrid system has a test of its own, a type is extended only where a variable may be of either, and a component that
no other file mentions is private. The top level holds what TOP names and nothing else, and no file
is large: what a trial leaves behind does not get in.
"""

from __future__ import annotations

import argparse
import fnmatch
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "support"))

from check_docs import check_docs
from check_python import check_python
from count_statements import MOST_STATEMENTS, executable_statements
from fortran_source import statements

# room of src/: the rooms below it that it may use, besides itself (the table of docs/architecture.md)
LAYERS = {
    "core": set(),
    "input": {"core"},
    "linalg": {"core"},
    "contact": {"core"},
    "eigen": {"core", "linalg"},
    "rotor": {"core", "linalg", "eigen"},
    "machine": {"core", "linalg", "contact"},
    "motion": {"core", "machine"},
    "scenes": {"core", "input", "linalg", "contact", "rotor", "machine", "motion"},
    "hybrid": {"core", "linalg", "contact", "machine", "motion"},
}
LAYERS["observe"] = {"core", "linalg", "contact", "machine", "motion"}
LAYERS["orbits"] = LAYERS["hybrid"] | {"hybrid", "observe"}
LAYERS["exact"] = LAYERS["hybrid"] | {"hybrid"}
LAYERS["runge_kutta"] = LAYERS["hybrid"] | {"hybrid"}
LAYERS["moreau"] = LAYERS["hybrid"] | {"hybrid"}
LAYERS["io"] = {"core", "input"}
LAYERS["sweep"] = {"core", "input", "io"}
LAYERS["study"] = set(LAYERS)
DRIVERS = "drivers"

# modules from outside: expression on the name, and who may use them (everybody, where None)
EXTERNAL = [
    (r"iso_fortran_env|iso_c_binding|ieee_arithmetic|ieee_exceptions|ieee_features", None),
    (r"mpi_f08", {"sweep", DRIVERS}),
    (r"hdf5|h5\w+", {"io"}),
]

MAX_COLUMNS = 132
MAX_FILES = 20

# what may stand at the top level: folders, files of the project, files of tools
TOP = {"bench", "cmake", "docs", "drivers", "inputs", "post", "src", "tests"}
TOP |= {
    "CHANGELOG.md",
    "CITATION.cff",
    "CMakeLists.txt",
    "CMakePresets.json",
    "LICENSE",
    "README.md",
    "pyproject.toml",
    "setup.sh",
}
TOP |= {
    ".ci",
    ".dockerignore",
    ".editorconfig",
    ".fortitude.toml",
    ".fprettify.rc",
    ".github",
    ".gitignore",
    ".ruff.toml",
}
MAX_BYTES = 1_000_000

USE = re.compile(r"use\b(?:\s*,\s*(?:non_)?intrinsic\s*)?(?:\s*::)?\s*(\w+)\s*(,\s*only\s*:)?")
UNIT = re.compile(r"(module|program)\s+(\w+)$")
CONDITION = r"(?:if\s*\(.*\)\s*)?"
STOP = re.compile(
    CONDITION + r"(?:error\s+)?stop\b(?!\s*(?:%|=|\([^=]*\)\s*[%=]))|" + CONDITION + r"call\s+(?:exit|abort)\b"
)
PRINT = re.compile(CONDITION + r"(?:print\s*(?:\*|[\"']|\w+\s*(?:,|$))|write\s*\(\s*(?:unit\s*=\s*)?(?:\*|\d))")
STANDARD_UNIT = re.compile(r"use\b.*\biso_fortran_env\b.*\b(output_unit|error_unit)\b")
DECLARATION = re.compile(
    r"(?:integer|real|logical|character|complex|double\s+precision|type\s*\(|class\s*\(|procedure\s*\()(?!.*\bfunction\s+\w)"
)
EXTENDS = re.compile(r"type\b.*\bextends\s*\(\s*(\w+)\s*\).*::\s*(\w+)$")
TYPE = re.compile(r"type\b(?!\s*(?:\(|is\b)).*?(\w+)$")
BLOCK = re.compile(r"(?:abstract\s+)?(interface)\b|(type)\b(?!\s*\()|(enum)\s*,")

Breach = tuple[int, str]


def folder_of_module(name: str, driver_modules: set[str]) -> str | None:
    """The folder a module of the project belongs to; none for a module from outside."""
    if name in driver_modules:
        return DRIVERS
    rooms = [room for room in LAYERS if name.startswith(f"razy_{room}_")]
    return max(rooms, key=len, default="unknown" if name.startswith("razy_") else None)


def check_use(folder: str, code: list[Breach], driver_modules: set[str]) -> Iterator[Breach]:
    """Every `use`: does this folder know that module, and does the line say what it takes?"""
    allowed = LAYERS.get(folder, set(LAYERS)) | {folder}
    for line, text in code:
        match = USE.match(text)
        if not match or re.match(r"use\w*\s*[=%(]", text):
            continue
        name = match[1]
        if not match[2]:
            yield line, f"only: 'use {name}' does not say what it takes"
        used = folder_of_module(name, driver_modules)
        if used is not None:
            if used not in allowed:
                yield line, f"layers: {folder} must not use {used} ({name})"
            continue
        users = [who for pattern, who in EXTERNAL if re.fullmatch(pattern, name)]
        if not users:
            yield line, f"layers: {name} is no module of this project and not one of those it may use"
        elif users[0] is not None and folder not in users[0]:
            yield line, f"layers: {folder} must not use {name}, only {' and '.join(sorted(users[0]))} may"


def check_variables(code: list[Breach]) -> Iterator[Breach]:
    """Variables that outlive a call: those of the module, local ones with a value in their declaration or `save`."""
    block, contained = "", False
    for line, text in code:
        if block:
            block = "" if re.match(rf"end\s*{block}\b", text) else block
        elif text == "contains":
            contained = True
        elif re.match(r"save\b(?!\s*[=%(])", text):
            yield line, "state: 'save' keeps a variable from one call to the next"
        elif (match := BLOCK.match(text)) and not re.match(r"type\s+is\b", text):
            block = next(group for group in match.groups() if group)
        elif DECLARATION.match(text) and not re.search(r"\bparameter\b", text.partition("::")[0]):
            if not contained:
                yield line, "state: a module has no variables"
            elif has_initial_value(text):
                yield line, "state: a value in the declaration of a local variable is kept from one call to the next"


def has_initial_value(declaration: str) -> bool:
    """Whether a declaration with `::` gives an entity a value, or an attribute `save`."""
    attributes, found, entities = declaration.partition("::")
    shape = None
    while shape != entities:
        shape, entities = entities, re.sub(r"\([^()]*\)|\[[^\[\]]*\]", "", entities)
    return bool(found) and ("=" in entities or bool(re.search(r"\bsave\b", attributes)))


def check_unit(file: Path, folder: str, code: list[Breach]) -> Iterator[Breach]:
    """Name, `implicit none` and `private` of the one unit in a file."""
    line, first = code[0]
    unit = UNIT.match(first)
    if not unit:
        yield line, "unit: a file holds one module, or one program in drivers/"
        return
    expected = "_".join(("razy", *file.with_name(file.name.split(".")[0]).parts[1:]))
    if folder != DRIVERS and (unit[1], unit[2]) != ("module", expected):
        yield line, f"name: the path says 'module {expected}', the file '{first}'"
    for later, text in code[1:]:
        if UNIT.match(text):
            yield later, "unit: a file holds one module or program"
    texts = [re.sub(r"\s+", "", text) for _, text in code]
    if "implicitnone(type,external)" not in texts:
        yield line, "implicit: 'implicit none(type, external)' is missing"
    head = texts[: texts.index("contains")] if "contains" in texts else texts
    if unit[1] == "module" and "private" not in head_of_module(head):
        yield line, "private: a bare 'private' is missing"


def head_of_module(texts: list[str]) -> list[str]:
    """The statements without those of type definitions, whose `private` is another one."""
    head, inside = [], False
    for text in texts:
        if re.match(r"endtype", text):
            inside = False
        elif re.match(r"type(?!\().*", text):
            inside = True
        elif not inside:
            head.append(text)
    return head


def check_library(code: list[Breach]) -> Iterator[Breach]:
    """Nothing in the library ends the program or prints."""
    for line, text in code:
        if STOP.match(text):
            yield line, "stop: the library does not end the program"
        if PRINT.match(text) or STANDARD_UNIT.match(text):
            yield line, "print: the library does not print"


def check_source(root: Path, file: Path, driver_modules: set[str]) -> Iterator[Breach]:
    """All breaches of one Fortran file; `file` is relative to the root."""
    lines = (root / file).read_text(encoding="utf-8").splitlines()
    for number, line in enumerate(lines, 1):
        if len(line) > MAX_COLUMNS:
            yield number, f"columns: {len(line)} columns, more than {MAX_COLUMNS}"
    code = [(number, text.lower()) for number, text in statements(lines)]
    if not code:
        yield 1, "unit: an empty file"
        return
    folder = DRIVERS if file.parts[0] == DRIVERS else file.parts[1]
    if folder != DRIVERS and folder not in LAYERS:
        yield 1, f"layers: '{folder}' is no folder of the table of layers"
    yield from check_use(folder, code, driver_modules)
    yield from check_unit(file, folder, code)
    if folder != DRIVERS:
        yield from check_variables(code)
        yield from check_library(code)


def sources(root: Path, *folders: str) -> dict[Path, list[Breach]]:
    """The statements of every Fortran file in these folders, in lower case."""
    files = sorted(
        file for folder in folders for file in (root / folder).rglob("*") if file.suffix in {".f90", ".pf", ".in"}
    )
    texts = {file.relative_to(root): file.read_text(encoding="utf-8").replace("@assert", "assert") for file in files}
    return {file: [(n, s.lower()) for n, s in statements(text.splitlines())] for file, text in texts.items()}


def check_folders(root: Path) -> Iterator[str]:
    """How many Fortran files a folder holds."""
    folders = {file.parent for file in (root / "src").rglob("*.f90")}
    for folder in sorted(folders):
        count = len(list(folder.glob("*.f90")))
        if count > MAX_FILES:
            yield f"{folder.relative_to(root)}:1: folder: {count} files, more than {MAX_FILES}"


def check_hybrid_tests(root: Path) -> Iterator[str]:
    """Each module of the hybrid system has a test of its own."""
    for file in sorted((root / "src" / "hybrid").rglob("*.f90")):
        test = Path("tests", "hybrid", f"test_{file.stem}.pf")
        if not (root / test).is_file():
            yield f"{file.relative_to(root)}:1: tests: there is no {test}"


def check_extensions(files: dict[Path, list[Breach]]) -> Iterator[str]:
    """A type is extended only where a variable may be of either, or procedures of the parent are deferred."""
    texts = [text for code in files.values() for _, text in code]
    needed = {match[1] for text in texts if (match := re.match(r"class\s*\(\s*(\w+)\s*\).*::(?!\s*self\b)", text))}
    for code in files.values():
        inside = ""
        for _, text in code:
            if (match := TYPE.match(text)) and not text.startswith("end"):
                inside = match[1]
            elif re.match(r"procedure\b.*\bdeferred\b", text):
                needed.add(inside)
    for file, code in files.items():
        for line, text in code:
            match = EXTENDS.match(text)
            if match and match[1] not in needed:
                yield f"{file}:{line}: extends: no 'class({match[1]})' needs the parent of {match[2]}"


def public_components(code: list[Breach]) -> Iterator[tuple[int, str, str]]:
    """Line, type and name of each component that is not private."""
    inside, hidden = "", False
    for line, text in code:
        if re.match(r"end\s*type\b", text) or text == "contains":
            inside = ""
        elif not inside:
            match = TYPE.match(text)
            inside, hidden = (match[1], False) if match else ("", False)
        elif text == "private":
            hidden = True
        elif DECLARATION.match(text) and not hidden and not re.search(r"\bprivate\b", text.partition("::")[0]):
            entities, shape = text.partition("::")[2], None
            while shape != entities:
                shape, entities = entities, re.sub(r"\([^()]*\)|\[[^\[\]]*\]", "", entities)
            for entity in entities.split(","):
                yield line, inside, re.split(r"[^\w]", entity.strip())[0]


def public_names(code: list[Breach]) -> set[str]:
    """What the module makes public by name."""
    found = [re.match(r"public\s*::(.*)", text) for _, text in code]
    return {name.strip() for match in found if match for name in match[1].split(",")}


def check_components(library: dict[Path, list[Breach]], others: dict[Path, list[Breach]]) -> Iterator[str]:
    """A component that no other file reads (`%name`), sets (`name=`) or gives by place (`type_t(1.0)`) is private."""
    mentioned: dict[str, set[Path]] = {}
    for file, code in (library | others).items():
        for _, text in code:
            for name in re.findall(r"%\s*(\w+)|\b(\w+)\s*=(?!=)|\b(\w+_t)\s*\(\s*(?!\)|\w+\s*=[^=])", text):
                mentioned.setdefault("".join(name), set()).add(file)
    for file, code in library.items():
        known = public_names(code)
        for line, kind, name in public_components(code):
            if kind in known and not (mentioned.get(name, set()) | mentioned.get(kind, set())) - {file}:
                yield f"{file}:{line}: private: no other file mentions {name} of {kind}"


def check_types(root: Path) -> Iterator[str]:
    """What only all files together show: folders, tests of their own, extended types, components."""
    library = sources(root, "src")
    yield from check_folders(root)
    yield from check_hybrid_tests(root)
    yield from check_extensions(library | sources(root, DRIVERS))
    yield from check_components(library, sources(root, DRIVERS, "tests", "docs"))


def tracked_files(root: Path) -> list[Path] | None:
    """What git tracks and is there, relative to the root; none where the root is no clone."""
    free = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    command = ["git", "-C", str(root), "ls-files", "-z"]
    if not (root / ".git").exists():
        return None
    try:
        answer = subprocess.run(command, capture_output=True, check=True, env=free)
    except (OSError, subprocess.CalledProcessError):
        return None
    names = answer.stdout.decode().split("\0")
    return [Path(name) for name in names if name and (root / name).is_file()]


def unignored_files(root: Path) -> list[Path]:
    """Without git: all files that no line of .gitignore names, of which only names and `*` are understood."""
    ignore = root / ".gitignore"
    lines = ignore.read_text(encoding="utf-8").splitlines() if ignore.is_file() else []
    files = []
    for folder, folders, names in os.walk(root):
        at = Path(folder).relative_to(root)
        for line in [".git", *lines]:
            if line.startswith("/") and at.parts:
                continue
            folders[:] = [name for name in folders if not fnmatch.fnmatch(name, line.strip("/"))]
            if not line.endswith("/"):
                names = [name for name in names if not fnmatch.fnmatch(name, line.strip("/"))]
        files += [at / name for name in names]
    return files


def check_files(root: Path) -> Iterator[str]:
    """What stands at the top level, and how large files are."""
    files = tracked_files(root)
    files = sorted(unignored_files(root) if files is None else files)
    for top in sorted({file.parts[0] for file in files} - TOP):
        yield f"{top}:1: tree: does not belong at the top level"
    for file in files:
        size = (root / file).stat().st_size
        if size > MAX_BYTES:
            yield f"{file}:1: size: {size} bytes, more than {MAX_BYTES}"


def check_tree(root: Path) -> list[str]:
    """All breaches in a source tree, as `file:line: rule: text`."""
    files = sorted(
        path.relative_to(root)
        for folder in ("src", DRIVERS)
        for pattern in ("*.f90", "*.f90.in")
        for path in (root / folder).rglob(pattern)
    )
    driver_modules = {
        match[2]
        for file in files
        if file.parts[0] == DRIVERS
        for _, text in statements((root / file).read_text(encoding="utf-8").splitlines())
        if (match := UNIT.match(text.lower()))
    }
    breaches = list(check_files(root))
    for file in files:
        breaches += [f"{file}:{line}: {text}" for line, text in sorted(check_source(root, file, driver_modules))]
    for file in sorted((root / "tests").rglob("CMakeLists.txt")):
        for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), 1):
            if re.match(r"\s*add_pfunit_ctest\b", line):
                breaches.append(f"{file.relative_to(root)}:{number}: tests: razy_add_test sets what this call does not")
    breaches += check_types(root)
    if not any(file.parts[0] == "src" for file in files):
        breaches.append(f"{root}: tree: no Fortran file in src/")
    return breaches


def main() -> int:
    """Command line; see --help."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("root", type=Path, help="the source tree")
    root = parser.parse_args().root
    breaches = check_tree(root) + check_docs(root) + check_python(root)
    number = executable_statements(root)
    print(f"{number} executable statements in src/, of at most {MOST_STATEMENTS}")
    if number > MOST_STATEMENTS:
        breaches.append(f"src:1: size: {number} executable statements, more than {MOST_STATEMENTS}")
    print("\n".join(breaches) if breaches else "no breach of the house rules")
    return 1 if breaches else 0


if __name__ == "__main__":
    sys.exit(main())
