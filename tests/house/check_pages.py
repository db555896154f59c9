"""Compare the pages in docs/namelist with the schema, as `write_pages` prints it; exit code 1 if they differ.

A page begins with heading, meaning and table of its group; what follows is written by hand. `--update` puts the present
heads into the pages, and makes pages that are missing.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
from pathlib import Path

INDEX = "README.md"


def generated_heads(program: Path) -> dict[str, str]:
    """The head of each page by its name, in the order of the schemas.

    A page is called after its group; where a later kind of scene has another group of the same name, `kind_group`.
    """
    text = subprocess.run([program], capture_output=True, text=True, check=True).stdout
    pages: dict[str, str] = {}
    for part in re.split(r"^@", text, flags=re.MULTILINE)[1:]:
        kind, _, groups = part.partition("\n")
        for head in ("# `&" + rest.rstrip("\n") + "\n" for rest in groups.split("# `&")[1:]):
            name = head.split("`")[1].lstrip("&")
            if pages.setdefault(name, head) != head:
                pages[f"{kind}_{name}"] = head.replace("`\n", f"` of a {kind} scene\n", 1)
    return pages


def written_part(page: str) -> str:
    """What follows the table of a page."""
    lines = page.splitlines(keepends=True)
    rows = [number for number, line in enumerate(lines) if line.startswith("|")]
    if not rows:
        return ""
    last = rows[0]
    while last + 1 in rows:
        last += 1
    return "".join(lines[last + 1 :])


def differences(folder: Path, heads: dict[str, str]) -> list[str]:
    """One line for every page that does not say what the schema says."""
    found = []
    pages = {page.stem: page for page in folder.glob("*.md") if page.name != INDEX}
    index = (folder / INDEX).read_text(encoding="utf-8")
    for name, head in heads.items():
        page = pages[name].read_text(encoding="utf-8") if name in pages else ""
        written = written_part(page)
        if not page:
            found.append(f"{folder / name}.md: missing")
        elif page != head + written:
            found.append(f"{pages[name]}: heading, meaning or table is not what the schema says")
        elif not written.strip():
            found.append(f"{pages[name]}: nothing but the table")
        if f"({name}.md)" not in index:
            found.append(f"{folder / INDEX}: no link to {name}.md")
    return found + [f"{page}: there is no such group" for name, page in sorted(pages.items()) if name not in heads]


def main() -> int:
    """Command line; see --help."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=Path, help="write_pages")
    parser.add_argument("folder", type=Path, help="docs/namelist")
    parser.add_argument("--update", action="store_true", help="put the present heads into the pages")
    given = parser.parse_args()
    heads = generated_heads(given.program)
    if not heads:
        print(f"{given.program} printed no group")
        return 1
    if given.update:
        for name, head in heads.items():
            page = given.folder / f"{name}.md"
            rest = written_part(page.read_text(encoding="utf-8")) if page.exists() else ""
            page.write_text(head + rest, encoding="utf-8")
    found = differences(given.folder, heads)
    print("\n".join(found) if found else f"{len(heads)} pages agree with the schema")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
