"""The page of laws and drives says the truth: its inputs have the keys, the tests are there, the laws are drawn."""

import re

import pytest
from programs import SOURCE, plot, succeed

TEXT = (SOURCE / "docs" / "laws.md").read_text()
ROWS = {
    heading: [line.split("|")[1:-1] for line in part.splitlines() if line.startswith("|") and "`tests/" in line]
    for heading, part in re.findall(r"^## (Laws|Drives)\n(.*?)(?=^## |\Z)", TEXT, re.MULTILINE | re.DOTALL)
}
ALL = [row for rows in ROWS.values() for row in rows]


@pytest.mark.parametrize("row", ALL, ids=[row[0].strip() for row in ALL])
def test_the_input_has_the_keys_and_the_test_is_there(row):
    _, keys, _, case, test = row
    text = (SOURCE / case.strip(" `")).read_text()
    for said in re.findall(r"`([^`]+)`", keys):
        assert re.search(rf"{re.escape(said.replace(' ', ''))}\b|{re.escape(said)}", text), said
    for page in re.findall(r"\]\((namelist/\w+\.md)\)", keys):
        assert (SOURCE / "docs" / page).exists()
    file, name = re.findall(r"`([^`]+)`", test)
    assert re.search(rf"(def|subroutine) {name}\(", (SOURCE / file).read_text()), name


@pytest.mark.parametrize("case", sorted({row[3].strip(" `") for row in ROWS["Laws"]}))
def test_the_law_is_drawn(folder, case):
    succeed("razy-run", SOURCE / case, "--output", "run.h5")
    done = plot("run.h5", "--kind", "law", "--save", "law.png")
    assert done.returncode == 0, done.stderr
    assert (folder / "law.png").stat().st_size > 5000
