"""The commands in the pages: each names programs, options, inputs and keys that there are."""

import re
import shlex
import sys

import pytest
from programs import SOURCE, start

sys.path.insert(0, str(SOURCE / "post" / "src"))

from razy.check.cli import parser as check
from razy.plot.cli import parser as plot
from razy.report.cli import parser as report
from razy.tools import cli as tools
from razy.view.cli import parser as view

PAGES = [SOURCE / "README.md", SOURCE / "post/README.md", *sorted((SOURCE / "docs").rglob("*.md"))]
COMPUTING = ("razy-run", "razy-sweep", "razy-modes", "razy-tune", "razy-follow", "razy-duel")
PARSED = {"razy-check": check, "razy-plot": plot, "razy-view": view, "razy-report": report}
MAINS = {"razy-merge": tools.merge_main, "razy-csv": tools.csv_main, "razy-export": tools.export_main}
# Names of files that a reader is to have, with something in their place.
STAND_INS = dict.fromkeys(("again.nml", "case.nml", "gear_pair.nml", "motion.nml"), "torsional_gear_pair.nml")


def commands(page):
    """Return the commands of razy in the fenced blocks of a page, as lists of words."""
    found = []
    for language, block in re.findall(r"```(\w*)\n(.*?)```", page.read_text(), flags=re.DOTALL):
        if language not in ("", "sh", "bash"):
            continue
        for line in block.replace("\\\n", " ").splitlines():
            for part in re.split(r"&&|;| & ", re.sub(r"\s#.*", "", line)):
                words = shlex.split(part) if re.match(r"\s*(mpirun .*|\S*/)?razy-\w+ ", part) else []
                place = next((k for k, word in enumerate(words) if re.fullmatch(r"(\S*/)?razy-\w+", word)), None)
                if place is not None:
                    found.append([words[place].rpartition("/")[2], *words[place + 1 :]])
    return found


def input_called(name, page):
    """Return the text of an input: of the page itself, of the inputs, or what stands in for it; None if unknown."""
    own = re.search(rf"`{re.escape(name)}`[^`]*```\n(&scene.*?)```", page.read_text(), flags=re.DOTALL)
    if own:
        return own[1]
    stem = STAND_INS.get(name, name).removeprefix("inputs/")
    for folder in ("inputs", "inputs/thesis"):
        path = SOURCE / folder / stem
        if path.is_file():
            return path.read_text()
    return None


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(SOURCE)))
def test_commands_of_a_page(page, folder, capsys):
    given = commands(page)
    # What another command of the page begins with has to be there.
    needed = {name for _, *words in given for name in re.findall(r"start_file='(.*?)'", " ".join(words))}
    for program, *words in given:
        if program in PARSED:
            PARSED[program]().parse_args(words)
            continue
        if program in MAINS:
            # Without the files it says that they are not there, and not that the words are wrong.
            try:
                assert MAINS[program](words) == 2
            except SystemExit as stop:
                assert stop.code == 0, (program, words, capsys.readouterr().err)
            assert "usage" not in capsys.readouterr().err
            continue
        assert program in COMPUTING, program
        if not words[0].endswith(".nml"):
            assert words == ["--version"] or words == ["--help"] or not words, (program, words)
            continue
        text = input_called(words[0], page)
        assert text is not None, f"{program} {words[0]}"
        (folder / "case.nml").write_text(text)
        check = [] if needed.intersection(words) else ["--check"]
        done = start(program, "case.nml", *check, *words[1:])
        assert done.returncode == 0, (program, words, done.stderr)


def test_there_are_commands():
    assert sum(len(commands(page)) for page in PAGES) > 60
