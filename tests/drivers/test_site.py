"""The site's parts that are made: pages at their places, notebooks, the gallery, the table of what is validated."""

import re
import sys

import pytest
from programs import SOURCE, start

sys.path.insert(0, str(SOURCE / "docs" / "site"))

import build as site

INPUTS = sorted((SOURCE / "inputs").glob("*.nml"))


def test_links_lead_to_what_is_staged(folder):
    site.stage(folder / "pages")
    for page in (folder / "pages").rglob("*.md"):
        for target in re.findall(r"\]\(([^)#\s]+)", page.read_text()):
            assert "://" in target or (page.parent / target).is_file(), (page.name, target)
    assert (folder / "pages/docs/namelist/README.md").read_text().startswith("# The input file")
    made = (folder / "pages/docs/notebooks/gear_pair.md").read_text()
    assert made.startswith("# A gear pair with backlash") and "```python\nimport razy" in made


def test_a_link_to_nothing_stops_the_site(folder, monkeypatch):
    (folder / "docs").mkdir()
    (folder / "docs/page.md").write_text("[there](../src/no.f90)")
    monkeypatch.setattr(site, "ROOT", folder)
    with pytest.raises(SystemExit, match=r"docs/page.md: a link to ../src/no.f90, which is not there"):
        site.stage(folder / "pages")


def test_the_gallery_has_every_input_with_a_program_that_takes_it(folder):
    page = site.gallery(folder)
    for path in INPUTS:
        command = re.search(rf"```\n(razy-\w+) inputs/{path.name} && razy-plot {path.stem}\.h5\n```", page)
        assert start(command[1], path, "--check").returncode == 0, path.name


def test_the_table_of_the_report_has_its_targets():
    table = site.items()
    assert "| Table 4.3 | 1, before (Hz) | 39.22 ± 0.005 | 39,22 | agrees with the source |" in table
    assert len({line.count("|") - line.count(r"\|") for line in table.splitlines()}) == 1
