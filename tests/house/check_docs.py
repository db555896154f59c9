"""What the pages of the project say of its tree, and their form.

The picture of the rooms in docs/architecture.md is drawn from the `use` lines; `--update` draws it anew. Names in
`code` that look like paths or identifiers exist. Outside tables and code a sentence begins a line, of at most 160
columns.
"""

from __future__ import annotations

import argparse
import fnmatch
import re
import sys
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "support"))

from fortran_source import statements

MAX_COLUMNS = 160
# the line of a namelist page that holds the meaning of its group
MEANING = 3
PICTURE = Path("docs/architecture.md")
BEGIN, END = "<!-- rooms: drawn by tests/house/check_docs.py -->", "<!-- end of rooms -->"

# folders whose paths may be named
FOLDERS = ("bench", "cmake", "docs", "drivers", "inputs", "post", "src", "tests")
SOURCES = ("*.f90", "*.f90.in", "*.pf", "*.py", "*.txt", "*.cmake", "*.nml", "*.c", "*.cpp", "*.in", "*.toml", "*.json")

ABBREVIATIONS = (
    "e\\.g i\\.e cf vs Fig Eq Sec No vol pp ed Numer Math Int Phys Mech Appl Eng Engng Proc Trans Comput Meth Sci Soc "
    "Vib Dyn Nonlin Univ Dr St Lond Roy Anal Rev Ser Softw"
)
SENTENCE = re.compile(
    r"(?<!\b[^\W\d_])"
    + "".join(rf"(?<!\b{word})" for word in ABBREVIATIONS.split())
    + r"[.!?][)\"*_`”]* +(?=[\"“(*_`\[]*(?:[A-ZÁ-Ž]|razy))"
)

Line = tuple[int, str]


def pages(root: Path) -> list[Path]:
    """The pages that are checked, relative to the root; docs/api.md is settings of FORD in the main."""
    found = sorted((root / "docs").rglob("*.md")) + sorted((root / "bench").glob("*.md"))
    found += [root / name for name in ("README.md", "CHANGELOG.md")]
    found = [page for page in found if page.name != "api.md"]
    return [page.relative_to(root) for page in found if page.is_file()]


def rooms_used(root: Path) -> dict[str, set[str]]:
    """Each room of src/ and the drivers, with the rooms that its `use` lines name."""
    rooms = {folder.name for folder in (root / "src").iterdir() if folder.is_dir()}
    used: dict[str, set[str]] = {room: set() for room in [*rooms, "drivers"]}
    for file in sorted((root / "src").rglob("*.f90")) + sorted((root / "drivers").glob("*.f90")):
        room = file.relative_to(root / "src").parts[0] if "src" in file.relative_to(root).parts else "drivers"
        for _, text in statements(file.read_text(encoding="utf-8").splitlines()):
            match = re.match(r"use\s+razy_(\w+)", text.lower())
            names = [name for name in rooms if match and match[1].startswith(f"{name}_")]
            used[room] |= {max(names, key=len)} - {room} if names else set()
    return used


def picture(root: Path) -> str:
    """The rooms as a Mermaid diagram: an arrow to each room that is used and is not reached over another one."""
    used = rooms_used(root)

    def reached(room: str) -> set[str]:
        return used[room] | {further for next_room in used[room] for further in reached(next_room)}

    lines = ["```mermaid", "flowchart TD"]
    for room in sorted(used):
        over_others = {further for next_room in used[room] for further in reached(next_room)}
        lines += [f"    {room} --> {target}" for target in sorted(used[room] - over_others)]
    return "\n".join([BEGIN, *lines, "```", END])


def drawn(text: str) -> tuple[int, int] | None:
    """Where the picture stands in the page."""
    begin, end = text.find(BEGIN), text.find(END)
    return (begin, end + len(END)) if 0 <= begin < end else None


def prose(lines: list[str]) -> Iterator[Line]:
    """The lines outside fences, tables, indented code and headings."""
    fenced = listed = False
    for number, line in enumerate(lines, 1):
        if re.match(r"\s*```", line):
            fenced = not fenced
        elif not fenced and not re.match(r"\s*(\||#|<)", line):
            listed = bool(re.match(r"\s*([-*+]|\d+[.)])\s", line)) or (listed and line.startswith("  "))
            if listed or not line.startswith("    "):
                yield number, line


def check_form(lines: list[str]) -> Iterator[Line]:
    """Length and sentences."""
    for number, line in prose(lines):
        if len(line) > MAX_COLUMNS:
            yield number, f"columns: {len(line)} columns, more than {MAX_COLUMNS}"
        bare = re.sub(r"`[^`]*`", "`x`", re.sub(r"^\s*([-*+]|\d+[.)])\s+", "", line))
        if SENTENCE.search(bare):
            yield number, "sentence: a second sentence on the line"


def words_of(root: Path) -> set[str]:
    """Every word of the sources."""
    words: set[str] = set()
    for folder in (*FOLDERS, "."):
        for pattern in SOURCES:
            for file in (root / folder).glob(pattern) if folder == "." else (root / folder).rglob(pattern):
                words |= {word.lower() for word in re.findall(r"\w+", file.read_text(encoding="utf-8"))}
                words.add(file.name.split(".")[0].lower())
    return words


def paths_of(root: Path) -> set[str]:
    """Every path of the tree with its tails, without and with the ending: `rotor/whirl`, `whirl/campbell`, …"""
    found: set[str] = set()
    for folder in FOLDERS:
        for path in [root / folder, *(root / folder).rglob("*")]:
            parts = path.relative_to(root).parts
            for k in range(len(parts)):
                tail = "/".join(parts[k:])
                found |= {tail, tail.removesuffix(path.suffix)}
    return found


def check_names(lines: list[str], words: set[str], paths: set[str]) -> Iterator[Line]:
    """Paths and identifiers in `code`; in a path `*` and `<kind>` stand for anything."""
    for number, line in outside_fences(lines):
        for code in re.findall(r"`([^`]+)`", line):
            if re.fullmatch(r"[\w./<>*-]+\.(f90|pf|py|cmake)|docs/[\w./<>*-]+\.md", code):
                pattern = re.sub(r"<\w+>", "*", code)
                if code not in paths and not ("*" in pattern and fnmatch.filter(paths, pattern)):
                    yield number, f"name: there is no {code}"
            elif re.fullmatch(r"(?!build|\.venv)([\w.-]{5,}|src|post)/[\w./-]*", code):
                if code.rstrip("/") not in paths:
                    yield number, f"name: there is no {code}"
            elif re.fullmatch(r"[a-zA-Z]\w*_\w+", code) and code.lower() not in words:
                yield number, f"name: nothing is called {code}"


def check_places(root: Path, lines: list[str]) -> Iterator[Line]:
    """Where a page says that a name is `in` or `of` a file of the tree, the file has it."""
    for number, line in outside_fences(lines):
        for name, file in re.findall(r"`(\w+)`(?: \([^)]*\))? (?:in|of) `((?:src|tests|post|drivers)/[\w./-]+)`", line):
            if (root / file).is_file() and not re.search(
                rf"\b{name}\b", (root / file).read_text(encoding="utf-8"), re.I
            ):
                yield number, f"name: {file} has no {name}"


def outside_fences(lines: list[str]) -> Iterator[Line]:
    """All lines outside fences."""
    fenced = False
    for number, line in enumerate(lines, 1):
        if re.match(r"\s*```", line):
            fenced = not fenced
        elif not fenced:
            yield number, line


def check_docs(root: Path) -> list[str]:
    """All breaches in the pages, as `file:line: rule: text`."""
    breaches, words, paths = [], words_of(root), paths_of(root)
    for page in pages(root):
        lines = (root / page).read_text(encoding="utf-8").splitlines()
        found = [*check_form(lines)]
        # The heads of these pages come from the schema (check_pages.py), with keys that prefixes make longer.
        if page.parent.name == "namelist":
            found = [breach for breach in found if breach[0] != MEANING]
        else:
            found += check_names(lines, words, paths)
            found += check_places(root, lines)
        breaches += [f"{page}:{number}: {text}" for number, text in sorted(found)]
    if (root / PICTURE).is_file():
        text = (root / PICTURE).read_text(encoding="utf-8")
        place = drawn(text)
        if place is None or text[place[0] : place[1]] != picture(root):
            breaches.append(f"{PICTURE}:1: picture: the rooms have changed; check_docs.py --update draws them")
    return breaches


def update(root: Path) -> None:
    """Draw the picture of the rooms anew."""
    text = (root / PICTURE).read_text(encoding="utf-8")
    begin, end = drawn(text) or sys.exit(f"{PICTURE}: no lines '{BEGIN}' and '{END}'")
    (root / PICTURE).write_text(text[:begin] + picture(root) + text[end:], encoding="utf-8")


def main() -> int:
    """Command line; see --help."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("root", type=Path, help="the source tree")
    parser.add_argument("--update", action="store_true", help="draw the picture of the rooms anew")
    arguments = parser.parse_args()
    if arguments.update:
        update(arguments.root)
    breaches = check_docs(arguments.root)
    print("\n".join(breaches) if breaches else "no breach in the pages")
    return 1 if breaches else 0


if __name__ == "__main__":
    sys.exit(main())
