"""The page of laws and drives says the truth: its inputs have the keys, the tests are there, the laws are drawn."""

import re
import shutil

import pytest
from programs import SOURCE, plot, succeed

TEXT = (SOURCE / "docs" / "laws.md").read_text()
ROWS = {
    heading: [line.split("|")[1:-1] for line in part.splitlines() if line.startswith("|") and "`tests/" in line]
    for heading, part in re.findall(r"^## ([^\n]*)\n(.*?)(?=^## |\Z)", TEXT, re.MULTILINE | re.DOTALL)
}
ALL = ROWS["Laws"] + ROWS["Drives"]
ASKED = ROWS["Machines that people ask about"]


def check_test(said):
    file, name = re.findall(r"`([^`]+)`", said)
    assert re.search(rf"(def|subroutine) {name}\(", (SOURCE / file).read_text()), name


@pytest.mark.parametrize("row", ALL, ids=[row[0].strip() for row in ALL])
def test_the_input_has_the_keys_and_the_test_is_there(row):
    _, keys, _, case, test = row
    text = (SOURCE / case.strip(" `")).read_text()
    for said in re.findall(r"`([^`]+)`", keys):
        assert re.search(rf"{re.escape(said.replace(' ', ''))}\b|{re.escape(said)}", text), said
    for page in re.findall(r"\]\((namelist/\w+\.md)\)", keys):
        assert (SOURCE / "docs" / page).exists()
    check_test(test)


@pytest.mark.parametrize("row", ASKED, ids=[row[1].strip(" `") for row in ASKED])
def test_what_is_asked_is_an_input_with_a_test(folder, row):
    _, case, test = row
    place = SOURCE / case.strip(" `")
    for table in place.parent.glob("*.csv"):
        (folder / "inputs" / place.parent.name).mkdir(parents=True, exist_ok=True)
        shutil.copy(table, folder / "inputs" / place.parent.name)
    program = "razy-modes" if "&campbell" in place.read_text() else "razy-run"
    succeed(program, place, "--check")
    check_test(test)


def test_each_input_of_the_field_is_on_the_page():
    asked = {row[1].strip(" `") for row in ASKED}
    assert {f"inputs/field/{path.name}" for path in (SOURCE / "inputs" / "field").glob("*.nml")} <= asked


@pytest.mark.parametrize("case", sorted({row[3].strip(" `") for row in ROWS["Laws"]}))
def test_the_law_is_drawn(folder, case):
    succeed("razy-run", SOURCE / case, "--output", "run.h5")
    done = plot("run.h5", "--kind", "law", "--save", "law.png")
    assert done.returncode == 0, done.stderr
    assert (folder / "law.png").stat().st_size > 5000


@pytest.mark.parametrize("case", ["iwan", "duffing", "two_rate_coupling", "motor_start", "field/woodpecker"])
def test_the_machine_is_drawn(folder, case):
    """Springs and dampers whose force is no straight line, and bodies on pins."""
    succeed("razy-run", SOURCE / "inputs" / f"{case}.nml", "--output", "run.h5")
    done = plot("run.h5", "--kind", "machine", "--save", "machine.png")
    assert done.returncode == 0, done.stderr
    assert (folder / "machine.png").stat().st_size > 5000
