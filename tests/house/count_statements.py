"""Executable statements of src/: the house is to stay one that can be read.

Continued lines count once, each part of a line with `;`, not comments, declarations, headings and `end`: neither long
lines nor procedures of one line change the number. Of C every `;` counts.
"""

from __future__ import annotations

import re
from pathlib import Path

from fortran_source import statements

MOST_STATEMENTS = 19_766

DECLARES = re.compile(
    r"(use|implicit|private|public|protected|contains|module|submodule|import|interface|abstract|save|external|parameter|"
    r"procedure|generic|final|enum|enumerator|program|allocatable|end|end(if|do|where|select|associate|function|subroutine|"
    r"module|type))\b|type\b(?!\s+is)|(?!allocate)[\w\s(),*=:%+\-.'\"]*::"
)
HEADING = re.compile(
    r"((pure|elemental|recursive|impure|module|integer|real|logical|complex|character)\b(\(.*?\))?\s*)*(subroutine|function)\b"
)


def executable_statements(root: Path) -> int:
    """Their number."""
    number = 0
    for file in (root / "src").rglob("*.f90"):
        found = [text.lower() for _, text in statements(file.read_text(encoding="utf-8").splitlines())]
        number += sum(not DECLARES.match(text) and not HEADING.match(text) for text in found)
    for file in (root / "src").rglob("*.c"):
        number += re.sub(r"/\*.*?\*/|//[^\n]*", "", file.read_text(encoding="utf-8"), flags=re.S).count(";")
    return number
