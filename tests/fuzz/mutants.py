"""Inputs of `inputs/` with random damage: what a slip of the hand, an editor or a script makes of them."""

import re
from pathlib import Path

SOURCE = Path(__file__).parents[2]
INPUTS = sorted((SOURCE / "inputs").rglob("*.nml"))
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+\.?\d*(?:[eEdD][-+]?\d+)?(?![\w.])")
NAME = re.compile(r"\b[a-z_]\w*\b")
GROUP = re.compile(r"(?ms)^&.*?/[ \t]*$")
ODD = [
    "0",
    "-1",
    "1e30",
    "-1e30",
    "1e308",
    "1e-308",
    "1e400",
    "nan",
    "-inf",
    "2147483648",
    "3*1.0",
    "1,2,3",
    "",
    "'1'",
    "1.d",
]
STRAY = ["&", "/", "!", "'", '"', "=", ",", "(", ")", "*", "%", "\n", "\0", "\t", "\x7f", "é", "&end", "--", "1e", "()"]


def place(random, length):
    return int(random.integers(length + 1))


def one_of(random, found):
    return found[int(random.integers(len(found)))]


def another_number(text, random):
    found = list(NUMBER.finditer(text))
    if not found:
        return text
    where = one_of(random, found)
    new = one_of(random, ODD)
    if random.random() < 0.6:
        new = f"{float(re.sub('[dD]', 'e', where[0])) * 10 ** random.uniform(-9, 9):.17g}"
    return text[: where.start()] + new + text[where.end() :]


def another_name(text, random):
    found = list(NAME.finditer(text))
    if len(found) < 2:
        return text
    where, other = one_of(random, found), one_of(random, found)
    return text[: where.start()] + other[0] + text[where.end() :]


def stray_text(text, random):
    i = place(random, len(text))
    new = one_of(random, STRAY)
    if random.random() < 0.05:
        new *= 100000
    return text[:i] + new + text[i:]


def a_part_lost(text, random):
    i = place(random, len(text))
    return text[:i] + text[i + int(10 ** random.uniform(0.0, 2.5)) :]


def a_part_twice(text, random):
    i = place(random, len(text))
    return text[:i] + text[i : i + int(10 ** random.uniform(0.0, 3.0))] + text[i:]


def the_end_lost(text, random):
    return text[: place(random, len(text))]


def groups_mixed(text, random):
    """A group lost, twice, a thousand times, or in another place."""
    found = list(GROUP.finditer(text))
    if not found:
        return text
    where = one_of(random, found)
    rest = text[: where.start()] + text[where.end() :]
    i = one_of(random, [other.start() for other in GROUP.finditer(rest)] or [0])
    times = one_of(random, [0, 1, 2, 2, 1000])
    return rest[:i] + times * (where[0] + "\n") + rest[i:]


EDITS = [
    another_number,
    another_number,
    another_number,
    another_name,
    another_name,
    stray_text,
    a_part_lost,
    a_part_twice,
]
EDITS += [the_end_lost, groups_mixed, groups_mixed]


def mutant(random):
    """(text, programs that take it)."""
    text = one_of(random, INPUTS).read_text()
    programs = ["razy-run", "razy-run", "razy-modes"]
    programs += [f"razy-{name}" for name in ("sweep", "tune", "duel", "follow") if f"&{name}" in text]
    for _ in range(int(random.integers(1, 4))):
        text = one_of(random, EDITS)(text, random)
    if text.count("&duel") > 100:
        # Thousands of motions take the time that they take.
        programs = [program for program in programs if program != "razy-duel"]
    return text, programs
