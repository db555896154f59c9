"""Make the site of razy: its pages, the inputs as a gallery, what is validated, the library by FORD, with a search.

Pages lie as in the repository, so links between them hold; `mkdocs build --strict` checks them. With --gallery every
input is computed and drawn, which takes a minute or two; pictures that were made are shown.
"""

from __future__ import annotations

import argparse
import json
import re
import resource
import shutil
import subprocess
import sys
import tomllib
from functools import partial
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGES = ("README.md", "CHANGELOG.md", "docs/**/*.md", "post/README.md", "bench/README.md", "bench/report/*.md")
FILES = (
    "LICENSE", "CITATION.cff", "docs/images/*", "docs/notebooks/*.ipynb", "docs/examples/*", "docs/packaging/**/*",
    "bench/report/*.png", "inputs/*.nml", "inputs/thesis/*",
)  # fmt: skip
LINK = re.compile(r"(?<!!)\[([^\]]*)\]\(([^)#\s]+)(#[^)\s]*)?\)")
ITEMS = "<!-- items of the report -->"


def stage(folder: Path) -> None:
    """Copy pages and what they link to into a folder, as they lie in the repository."""
    shutil.rmtree(folder, ignore_errors=True)
    for pattern in (*PAGES, *FILES):
        for path in ROOT.glob(pattern):
            if path.is_file() and path.name != "api.md":
                target = folder / path.relative_to(ROOT)
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(path, target)
    for page in folder.rglob("*.md"):
        text = page.read_text(encoding="utf-8")
        page.write_text(LINK.sub(partial(_link, folder, page), text), encoding="utf-8")
    for notebook in (folder / "docs/notebooks").glob("*.ipynb"):
        notebook.with_suffix(".md").write_text(_from_notebook(notebook), encoding="utf-8")


def _link(folder: Path, page: Path, link: re.Match) -> str:
    """Return a link as it is, or the words alone where it leads to a source file that the site does not have."""
    words, target = link[1], link[2]
    if "://" in target or (page.parent / target).is_file():
        return link[0]
    place = (ROOT / page.parent.relative_to(folder) / target).resolve()
    if not place.exists():
        sys.exit(f"{page.relative_to(folder)}: a link to {target}, which is not there")
    return words if words.startswith("`") else f"{words} (`{place.relative_to(ROOT)}`)"


def _from_notebook(path: Path) -> str:
    """Return the cells of a notebook as a page."""
    parts = [f"*A notebook: [{path.name}]({path.name}). The tests execute it.*"]
    for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
        text = "".join(cell["source"])
        parts.append(f"```python\n{text}\n```" if cell["cell_type"] == "code" else text)
    head, *rest = [*parts[1:2], parts[0], *parts[2:]]
    return "\n\n".join([head, *rest]) + "\n"


def program_for(text: str) -> str:
    """Return the program that an input is made for."""
    groups = set(re.findall(r"(?m)^&(\w+)", text))
    fitting = (("duel", "duel"), ("sweep", "sweep"), ("follow", "follow"), ("motion", "run"), ("tune", "tune"))
    return next((f"razy-{program}" for group, program in fitting if group in groups), "razy-modes")


def gallery(pictures: Path) -> str:
    """Return the page of all inputs, with the pictures and times that are there."""
    parts = ["# Gallery", "Each input of the folder `inputs`, what it is, and its picture.", ""]
    for path in sorted((ROOT / "inputs").glob("*.nml")):
        text = path.read_text(encoding="utf-8")
        title = re.search(r"title\s*=\s*'((?:[^']|'')*)'", text)
        words = re.match(r"(?:!.*\n)*", text)[0].replace("! ", "").replace("!", "")
        parts += [f"## {title[1] if title else path.stem}", "", words, ""]
        note = pictures / f"{path.stem}.json"
        if note.is_file() and (pictures / f"{path.stem}.png").is_file():
            parts += [
                f"![{path.stem}](gallery/{path.stem}.png)",
                "",
                f"{json.loads(note.read_text())['seconds']:.1f} s of one processor.",
                "",
            ]
        command = f"{program_for(text)} inputs/{path.name} && razy-plot {path.stem}.h5"
        parts += [f"[{path.name}](inputs/{path.name}):", "", f"```\n{command}\n```", ""]
    return "\n".join(parts)


def draw_gallery(pictures: Path) -> None:
    """Compute and draw every input that is not there yet, or has changed."""
    sys.path.insert(0, str(ROOT / "post" / "src"))
    from razy.plot.cli import main as plot
    from razy.programs import find_program

    pictures.mkdir(parents=True, exist_ok=True)
    for path in sorted((ROOT / "inputs").glob("*.nml")):
        text, result, picture = (
            path.read_text(encoding="utf-8"),
            pictures / f"{path.stem}.h5",
            pictures / f"{path.stem}.png",
        )
        note = pictures / f"{path.stem}.json"
        if note.is_file() and json.loads(note.read_text())["input"] == text and picture.is_file():
            continue
        begin = processor_time()
        words = [find_program(program_for(text)), path, "--output", result, "--force"]
        done = subprocess.run(words, stdin=subprocess.DEVNULL, capture_output=True, text=True)
        seconds = processor_time() - begin
        if done.returncode != 0 or plot([str(result), "--save", str(picture), "--dpi", "110", "--force"]) != 0:
            sys.exit(f"{path.name}: {done.stderr.strip().splitlines()[-1:]}")
        note.write_text(json.dumps({"input": text, "seconds": seconds}))
        print(f"{path.name}: {seconds:.1f} s", flush=True)


def processor_time() -> float:
    """Return the processor time of all programs that have ended, s."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def items() -> str:
    """Return what the report on the source compares: number, what it should be, whose words those are, the verdict."""
    data = tomllib.loads((ROOT / "inputs/thesis/report.toml").read_text(encoding="utf-8"))
    lines = ["| item | number | should be | in the source | verdict |", "|---|---|---|---|---|"]
    for item in data["item"]:
        verdict = item.get("expected", item.get("verdict", ""))
        for number in item.get("number", []):
            wanted = [f"{number['should_be']:g} ± {number['tolerance']:g}"] if "tolerance" in number else []
            wanted += [f"{number['should_be']:g} within a factor of {number['factor']:g}"] if "factor" in number else []
            wanted += [
                f"{words} {number[key]:g}"
                for key, words in (("at_least", "at least"), ("at_most", "at most"))
                if key in number
            ]
            if wanted:
                text, quote = (number.get(key, "").replace("|", r"\|") for key in ("text", "quote"))
                lines.append(f"| {item['name']} | {text} | {', '.join(wanted)} | {quote} | {verdict} |")
    return "\n".join(lines)


def main() -> int:
    """Command line; see --help."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("build", type=Path, help="folder to build in, such as build")
    parser.add_argument("--gallery", action="store_true", help="compute and draw every input first")
    given = parser.parse_args()
    pictures, pages = given.build / "gallery", given.build / "site"
    if given.gallery:
        draw_gallery(pictures)
    stage(pages)
    for picture in pictures.glob("*.png"):
        (pages / "gallery").mkdir(exist_ok=True)
        shutil.copyfile(picture, pages / "gallery" / picture.name)
    shutil.copyfile(Path(__file__).with_name("site.css"), pages / "site.css")
    (pages / "gallery.md").write_text(gallery(pictures), encoding="utf-8")
    validation = pages / "docs/validation.md"
    validation.write_text(validation.read_text(encoding="utf-8").replace(ITEMS, items()), encoding="utf-8")
    ford = subprocess.run(
        ["ford", "docs/api.md", "--output_dir", str((pages / "api").resolve())],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    if ford.returncode != 0 or "Warning" in ford.stdout + ford.stderr:
        sys.exit(f"FORD: {ford.stdout}{ford.stderr}")
    config = ROOT / "docs/site/mkdocs.yml"
    return subprocess.run(["mkdocs", "build", "--strict", "--quiet", "--config-file", str(config)]).returncode


if __name__ == "__main__":
    sys.exit(main())
