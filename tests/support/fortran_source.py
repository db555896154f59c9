"""Free-form Fortran source, split into statements."""

from __future__ import annotations


def blank_strings(line: str) -> str:
    """The line with the contents of strings blanked and a comment removed; of the same length up to the comment."""
    out, quote = [], ""
    for char in line:
        if quote:
            out.append(char if char == quote else " ")
            quote = "" if char == quote else quote
        elif char == "!":
            break
        else:
            out.append(char)
            quote = char if char in "'\"" else ""
    return "".join(out)


def statements(lines: list[str]) -> list[tuple[int, str]]:
    """Statements of the lines with the line they begin on: strings blanked, comments and directives left out."""
    found, text, start = [], "", 0
    for number, line in enumerate(lines, 1):
        code = blank_strings(line).strip()
        if not code or code.startswith("@"):
            continue
        start = start if text else number
        text += code.removeprefix("&") if text else code
        if text.endswith("&"):
            text = text[:-1].rstrip() + " "
            continue
        found.extend((start, part.strip()) for part in text.split(";") if part.strip())
        text = ""
    return found
