"""The site's parts that are made: pages at their places, notebooks, the gallery, the table of what is validated."""

import json
import re
import sys

import pytest
from programs import SOURCE, start

sys.path.insert(0, str(SOURCE / "docs" / "site"))

from links import broken_links

import build as site

INPUTS = sorted((SOURCE / "inputs").glob("*.nml"))


def test_links_lead_to_what_is_staged(folder):
    site.stage(folder / "pages")
    for page in (folder / "pages").rglob("*.md"):
        for target in re.findall(r"\]\(([^)#\s]+)", page.read_text()):
            assert "://" in target or (page.parent / target).is_file(), (page.name, target)
    assert (folder / "pages/docs/namelist/README.md").read_text().startswith("# The input file")


def test_a_tutorial_shows_what_its_cells_give(folder, monkeypatch):
    (folder / "docs/notebooks").mkdir(parents=True)
    cells = [("markdown", "# Head"), ("code", "x = 2\nprint('a')\nx"), ("code", "y = 1"), ("markdown", "End.")]
    text = json.dumps({"cells": [{"cell_type": kind, "source": [source]} for kind, source in cells]})
    notebook = folder / "docs/notebooks/one.ipynb"
    notebook.write_text(text)
    monkeypatch.setattr(site, "ROOT", folder)
    site.execute_notebooks(folder / "made")
    site.tutorials(folder, folder / "made")
    page = notebook.with_suffix(".md").read_text()
    assert page.startswith("# Head\n\n*A notebook: [one.ipynb](one.ipynb).")
    assert "x\n```\n\n```text\na\n```\n\n```text\n2\n```\n\n```python\ny = 1\n```\n\nEnd." in page
    notebook.write_text(text.replace("y = 1", "y = 3"))
    site.tutorials(folder, folder / "made")
    assert "```text" not in notebook.with_suffix(".md").read_text(), "results of another text"


def test_formulas_are_drawn_by_the_browser(folder):
    pytest.importorskip("latex2mathml")
    site.stage(folder / "pages")
    count = 0
    for page in (folder / "pages").rglob("*.md"):
        text = page.read_text()
        made = site.formulas(text)
        assert "```math" not in made and made.count("<math") == text.count("```math"), page.name
        # What it does not know it writes as it is, with its backslash.
        assert not re.search(r">[^<]*\\\\", "".join(re.findall(r"(?s)<math.*?</math>", made))), page.name
        count += made.count("<math")
    assert count > 10


def test_links_of_a_site(folder):
    page = "<h1 id='top'>x</h1><a href='{}'>x</a><{} src='{}'></{}>"
    (folder / "sub").mkdir()
    (folder / "sub/index.html").write_text(page.format("../one.html#top", "img", "../a.png", "img"))
    (folder / "a.png").touch()
    for link, element, source, why in (
        ("sub", "img", "a.png", None),
        ("https://example.org/", "img", "data:x", None),
        ("sub/none.html", "img", "a.png", "sub/none.html: not there"),
        ("sub/index.html#end", "img", "a.png", "sub/index.html#end: no such place"),
        ("/sub/index.html", "img", "a.png", "/sub/index.html: an absolute path"),
        ("file:///tmp", "img", "a.png", "file:///tmp: neither a page of the site nor of the web"),
        ("sub", "script", "https://example.org/a.js", "https://example.org/a.js: loaded from elsewhere"),
        ("sub", "script", "//example.org/a.js", "//example.org/a.js: loaded from elsewhere"),
    ):
        (folder / "one.html").write_text(page.format(link, element, source, element))
        assert broken_links(folder) == ([] if why is None else [f"one.html: {why}"])


def test_every_command_of_the_first_page_takes_its_input():
    page = (SOURCE / "docs/start.md").read_text()
    commands = re.findall(r"`(razy-\w+) (inputs/\w+\.nml)", page)
    assert len(commands) > 12
    for program, path in commands:
        assert start(program, SOURCE / path, "--check").returncode == 0, (program, path)


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
        for program in (command[1], *(further[0] for further in site.FURTHER.get(path.stem, []))):
            assert start(program, path, "--check").returncode == 0, (program, path.name)


def test_the_table_of_the_report_has_its_targets():
    table = site.items()
    assert "| Table 4.3 | 1, before (Hz) | 39.22 ± 0.005 | 39,22 | agrees with the source |" in table
    assert len({line.count("|") - line.count(r"\|") for line in table.splitlines()}) == 1
