"""Make the site of razy: its pages, the inputs as a gallery, what is validated, the library by FORD, with a search.

Pages lie as in the repository, so links between them hold; links.py checks those of the site. Tutorials show what their
cells give where the programs are built. With --gallery every input is computed and drawn, which takes a minute or two;
pictures that were made are shown.
"""

from __future__ import annotations

import argparse
import ast
import io
import json
import os
import re
import resource
import shutil
import subprocess
import sys
import tomllib
from contextlib import chdir, redirect_stdout
from functools import partial
from pathlib import Path
from typing import Any

from links import broken_links

ROOT = Path(__file__).resolve().parents[2]
PAGES = ("README.md", "CHANGELOG.md", "docs/**/*.md", "post/README.md", "bench/README.md", "bench/report/*.md")
FILES = (
    "LICENSE", "CITATION.cff", "docs/images/*", "docs/notebooks/*.ipynb", "docs/examples/*", "docs/packaging/**/*",
    "bench/report/*.png", "inputs/*.nml", "inputs/thesis/*",
)  # fmt: skip
LINK = re.compile(r"(?<!!)\[([^\]]*)\]\(([^)#\s]+)(#[^)\s]*)?\)")
ITEMS = "<!-- items of the report -->"
# Further pictures of an input in the gallery: program, kind, what it shows.
FURTHER = {
    "ball_bearing": [
        ("razy-run", "orbit", "The orbit of the shaft in the bearing, with a mark once in each revolution.")
    ],
    "bush": [("razy-run", "law", "The law of the contact, and the friction in it.")],
    "coaxial_shafts": [("razy-modes", "campbell", "The Campbell diagram, with the lines of both speeds.")],
    "drop_test": [("razy-run", "law", "The law of the contact.")],
    "duffing": [("razy-run", "law", "The law of the spring.")],
    "iwan": [("razy-run", "law", "The laws of the sliders.")],
    "loose_pedestal": [
        ("razy-run", "orbit", "The orbit of the disk while the foot lifts, with a mark once in each revolution.")
    ],
    "rotor_whirl": [("razy-modes", "bode", "The response to unbalance, with the range of operation.")],
    "run_up": [
        ("razy-run", "ordermap", "Amplitudes over speed and order."),
        ("razy-run", "orbit", "The orbit, with a mark once in each revolution: the phase turns at the critical speed."),
    ],
    "motor_start": [("razy-run", "law", "The torques over the speed.")],
    "quarter_car": [("razy-run", "law", "The laws of the absorber and the tyre.")],
    "snap_through": [("razy-run", "law", "The law of the beam.")],
    "test_gearbox": [("razy-modes", "campbell", "The Campbell diagram of both shafts in mesh.")],
    "two_rate_coupling": [("razy-run", "law", "The law of the coupling.")],
    "vibropress": [("razy-sweep", "machine", "The machine.")],
}


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


def _link(folder: Path, page: Path, link: re.Match) -> str:
    """Return a link as it is, or the words alone where it leads to a source file that the site does not have."""
    words, target = link[1], link[2]
    if "://" in target or (page.parent / target).is_file():
        return link[0]
    place = (ROOT / page.parent.relative_to(folder) / target).resolve()
    if not place.exists():
        sys.exit(f"{page.relative_to(folder)}: a link to {target}, which is not there")
    return words if words.startswith("`") else f"{words} (`{place.relative_to(ROOT)}`)"


def tutorials(folder: Path, made: Path) -> None:
    """Write a page for each notebook, with what its cells gave where `made` has it."""
    for notebook in (folder / "docs/notebooks").glob("*.ipynb"):
        note = made / f"{notebook.stem}.json"
        known = json.loads(note.read_text(encoding="utf-8")) if note.is_file() else {}
        given = known.get("given", []) if known.get("notebook") == notebook.read_text(encoding="utf-8") else []
        notebook.with_suffix(".md").write_text(from_notebook(notebook, given), encoding="utf-8")
        for picture in made.glob(f"{notebook.stem}-*.png"):
            shutil.copyfile(picture, notebook.parent / picture.name)


def formulas(text: str) -> str:
    """Return a page with its formulas, fences of the kind math, as MathML, which browsers draw by themselves."""
    from latex2mathml.converter import convert

    return re.sub(r"(?ms)^```math\n(.*?)\n```$", lambda found: f"\n{convert(found[1], display='block')}\n", text)


def from_notebook(path: Path, given: list[str]) -> str:
    """Return the cells of a notebook as a page, below each cell of code what it gave."""
    parts = [f"*A notebook: [{path.name}]({path.name}). The tests execute it.*"]
    results = iter(given)
    for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
        text = "".join(cell["source"])
        if cell["cell_type"] == "code":
            parts += [f"```python\n{text}\n```", next(results, "")]
        else:
            parts.append(text)
    head, *rest = [*parts[1:2], parts[0], *parts[2:]]
    return "\n\n".join(part for part in [head, *rest] if part) + "\n"


def execute_notebooks(made: Path) -> None:
    """Execute every notebook that has changed, and keep what its cells give."""
    sys.path.insert(0, str(ROOT / "post" / "src"))
    made.mkdir(parents=True, exist_ok=True)
    made = made.resolve()
    for path in sorted((ROOT / "docs/notebooks").glob("*.ipynb")):
        text, note = path.read_text(encoding="utf-8"), made / f"{path.stem}.json"
        if note.is_file() and json.loads(note.read_text(encoding="utf-8"))["notebook"] == text:
            continue
        known: dict[str, Any] = {}
        given = []
        with chdir(path.parent):
            for number, cell in enumerate(json.loads(text)["cells"]):
                if cell["cell_type"] == "code":
                    given.append(_given("".join(cell["source"]), known, made / f"{path.stem}-{number}.png"))
        note.write_text(json.dumps({"notebook": text, "given": given}), encoding="utf-8")


def _given(code: str, known: dict[str, Any], picture: Path) -> str:
    """Execute a cell; return what it prints and what its last line is, as a notebook shows them."""
    tree = ast.parse(code)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    with redirect_stdout(io.StringIO()) as printed:
        exec(compile(tree, "cell", "exec"), known)
        value = eval(compile(ast.Expression(last.value), "cell", "eval"), known) if last else None
    parts = [f"```text\n{printed.getvalue().rstrip()}\n```"] if printed.getvalue() else []
    if hasattr(value, "_repr_png_"):
        picture.write_bytes(value._repr_png_())
        parts.append(f"![{picture.stem}]({picture.name})")
    elif hasattr(value, "to_html"):
        parts.append(re.sub(r"\n\s*", "", value.to_html(border=0)))
    elif value is not None:
        parts.append(f"```text\n{value!r}\n```")
    return "\n\n".join(parts)


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
        for program, kind, shows in FURTHER.get(path.stem, []):
            parts += [
                shows,
                "",
                f"```\n{program} inputs/{path.name} && razy-plot {path.stem}.h5 --kind {kind}\n```",
                "",
            ]
            if (pictures / f"{path.stem}-{kind}.png").is_file():
                parts += [f"![{path.stem}, {kind}](gallery/{path.stem}-{kind}.png)", ""]
    return "\n".join(parts)


def draw_gallery(pictures: Path) -> None:
    """Compute and draw every input that is not there yet, or has changed."""
    sys.path.insert(0, str(ROOT / "post" / "src"))
    pictures.mkdir(parents=True, exist_ok=True)
    for path in sorted((ROOT / "inputs").glob("*.nml")):
        text, note = path.read_text(encoding="utf-8"), pictures / f"{path.stem}.json"
        wanted = {"input": text, "further": [list(one) for one in FURTHER.get(path.stem, [])]}
        if note.is_file() and json.loads(note.read_text()).items() >= wanted.items():
            continue
        result = pictures / f"{path.stem}.h5"
        seconds = _computed(program_for(text), path, result)
        _drawn(result, pictures / f"{path.stem}.png")
        for program, kind, _ in FURTHER.get(path.stem, []):
            other = pictures / f"{path.stem}.{program}.h5"
            _computed(program, path, other)
            _drawn(other, pictures / f"{path.stem}-{kind}.png", "--kind", kind)
        note.write_text(json.dumps(wanted | {"seconds": seconds}))
        print(f"{path.name}: {seconds:.1f} s", flush=True)


def _computed(program: str, path: Path, result: Path) -> float:
    """Compute an input; return the processor time in s."""
    from razy.programs import find_program

    begin = processor_time()
    words = [find_program(program), path, "--output", result, "--force"]
    done = subprocess.run(words, stdin=subprocess.DEVNULL, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{path.name}: {done.stderr.strip().splitlines()[-1:]}")
    return processor_time() - begin


def _drawn(result: Path, picture: Path, *options: str) -> None:
    from razy.plot.cli import main as plot

    if plot([str(result), "--save", str(picture), "--dpi", "110", "--force", *options]) != 0:
        sys.exit(f"{result.name}: not drawn")


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


def mend_library(folder: Path) -> None:
    """Take from the pages of FORD what is loaded from elsewhere, and links to places that it does not make."""
    import mkdocs

    theme = Path(mkdocs.__file__).parent / "themes/mkdocs"
    for kind, name in (("css", "bootstrap.min.css"), ("js", "bootstrap.bundle.min.js")):
        shutil.copyfile(theme / kind / name, folder / kind / name)
    pages = {page: page.read_text(encoding="utf-8") for page in folder.rglob("*.html")}
    places = {page.resolve(): set(re.findall(r'\bid="([^"]+)"', text)) for page, text in pages.items()}
    for page, text in pages.items():
        own = os.path.relpath(folder, page.parent)
        text = re.sub(
            r'"https://cdn\.jsdelivr\.net/npm/bootstrap@[^/]+/dist/(\w+)/([\w.]+)"(\s+(rel="stylesheet"))?'
            r'\s+integrity="[^"]*" crossorigin="\w+"',
            rf'"{own}/\1/\2" \4',
            text,
        )
        text = re.sub(r'(?s)<script type="text/x-mathjax-config">.*?</script>', "", text)
        text = re.sub(r'(?s)<script src="[^"]*MathJax\.js[^>]*></script>', "", text)
        text = re.sub(rf"(['\"]){re.escape(str(folder.resolve()))}/", rf"\1{own}/", text)

        def known(link: re.Match, page: Path = page) -> str:
            target = (page.parent / link[1]).resolve()
            return link[0] if link[2] in places.get(target, {link[2]}) else f'href="{link[1]}"'

        page.write_text(re.sub(r'href="([^"#:]+)#([^"]+)"', known, text), encoding="utf-8")


def main() -> int:
    """Command line; see --help."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("build", type=Path, help="folder to build in, such as build")
    parser.add_argument("--gallery", action="store_true", help="compute and draw every input first")
    given = parser.parse_args()
    pictures, pages = given.build / "gallery", given.build / "site"
    if given.gallery:
        draw_gallery(pictures)
    if (ROOT / "build/bin/razy-run").is_file():
        execute_notebooks(given.build / "tutorials")
    stage(pages)
    tutorials(pages, given.build / "tutorials")
    for picture in pictures.glob("*.png"):
        (pages / "gallery").mkdir(exist_ok=True)
        shutil.copyfile(picture, pages / "gallery" / picture.name)
    shutil.copyfile(Path(__file__).with_name("site.css"), pages / "site.css")
    (pages / "gallery.md").write_text(gallery(pictures), encoding="utf-8")
    validation = pages / "docs/validation.md"
    validation.write_text(validation.read_text(encoding="utf-8").replace(ITEMS, items()), encoding="utf-8")
    for page in pages.rglob("*.md"):
        page.write_text(formulas(page.read_text(encoding="utf-8")), encoding="utf-8")
    ford = subprocess.run(
        ["ford", "docs/api.md", "--output_dir", str((pages / "api").resolve())],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    if ford.returncode != 0 or "Warning" in ford.stdout + ford.stderr:
        sys.exit(f"FORD: {ford.stdout}{ford.stderr}")
    mend_library(pages / "api")
    config = ROOT / "docs/site/mkdocs.yml"
    words = ["mkdocs", "build", "--strict", "--quiet", "--config-file", str(config)]
    # The theme warns of a version of MkDocs that docs/requirements.txt does not take.
    done = subprocess.run(words, env=os.environ | {"NO_MKDOCS_2_WARNING": "1"}).returncode
    wrong = broken_links((given.build / "docs").resolve())
    print("\n".join(wrong) or "every link leads somewhere")
    return done or int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
