"""Compare the pages in docs/namelist with the schema, as `write_pages` prints it; exit code 1 if they differ.

A page begins with heading, meaning and table of its group; what follows is written by hand. A group of PLACES has its
part at the end of another's page. `--update` puts the present heads into the pages, and makes what is missing.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
from pathlib import Path

INDEX = "README.md"
# groups that stand on the page of the group that needs them
PLACES = {"start_range": "starts", "point": "body", "section": "shaft"}


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


def title_of(part: str) -> str:
    """The heading of a part, on whatever level."""
    return part.partition("\n")[0].lstrip("#")


def written_part(part: str) -> str:
    """What follows the table of a group."""
    lines = part.splitlines(keepends=True)
    rows = [number for number, line in enumerate(lines) if line.startswith("|")]
    if not rows:
        return ""
    last = rows[0]
    while last + 1 in rows:
        last += 1
    return "".join(lines[last + 1 :])


def renewed(text: str, heads: list[str]) -> tuple[str, list[str]]:
    """A page with the present heads, and the titles of the groups of which it says nothing but the head."""
    found = {title_of(part): written_part(part) for part in re.split(r"^(?=##? `&)", text, flags=re.MULTILINE)}
    written = [found.get(title_of(head), "").rstrip("\n") for head in heads]
    parts = [(head + rest).rstrip("\n") for head, rest in zip(heads, written, strict=True)]
    return "\n\n#".join(parts) + "\n", [title_of(head) for head, rest in zip(heads, written, strict=True) if not rest]


def differences(folder: Path, heads: dict[str, str], update: bool) -> list[str]:
    """One line for every page that does not say what the schema says, after its renewal if they are to be renewed."""
    found = []
    index = (folder / INDEX).read_text(encoding="utf-8")
    pages = {name: [name, *(part for part in PLACES if PLACES[part] == name)] for name in heads if name not in PLACES}
    for name, groups in pages.items():
        page = folder / f"{name}.md"
        text = page.read_text(encoding="utf-8") if page.exists() else ""
        new, bare = renewed(text, [heads[group] for group in groups])
        if update:
            page.write_text(new, encoding="utf-8")
        elif text != new:
            found.append(f"{page}: heading, meaning or table is not what the schema says")
        found += [f"{page}: nothing but the table of{title}" for title in bare]
        links = [f"{name}.md#{group}" if group in PLACES else f"{name}.md" for group in groups]
        found += [f"{folder / INDEX}: no link to {link}" for link in links if f"({link})" not in index]
    others = {page.stem for page in folder.glob("*.md") if page.name != INDEX} - set(pages)
    return found + [f"{folder / name}.md: there is no such group" for name in sorted(others)]


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
    found = differences(given.folder, heads, given.update)
    print("\n".join(found) if found else f"the pages of {len(heads)} groups agree with the schema")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
