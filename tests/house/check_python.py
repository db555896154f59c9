"""The rooms of the Python package: what each may use, that imports make no circle, that one room starts processes."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

PACKAGE = Path("post/src/razy")
# What any module may use; these use nothing but each other.
BASE = {"arguments", "errors", "target", "version"}
# room: the rooms below it that it may use, besides itself (docs/architecture.md)
LAYERS = {
    "read": set(),
    "programs": set(),
    "plot": {"read"},
    "check": {"read"},
    "tools": {"read", "programs", "plot"},
    "report": {"read", "programs", "plot", "check"},
    "view": {"read", "programs", "plot"},
    "results": {"read", "plot", "tools"},
    "calls": {"programs", "results"},
}
STARTS_PROCESSES = "programs"


def imports(tree: ast.AST) -> Iterator[tuple[int, list[str]]]:
    """Line and names of every import, also of those in procedures; of `from a import b` both `a` and `a.b`."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield node.lineno, [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            yield node.lineno, [node.module or ".", *(f"{node.module}.{alias.name}" for alias in node.names)]


def check_python(root: Path) -> list[str]:
    """All breaches, as `file:line: rule: text`."""
    found, uses = [], {}
    modules = {
        ".".join(("razy", *file.relative_to(root / PACKAGE).with_suffix("").parts)).removesuffix(".__init__"): file
        for file in sorted((root / PACKAGE).rglob("*.py"))
    }
    for module, file in modules.items():
        room, place = (module.split(".") + [""])[1], file.relative_to(root)
        uses[module] = set()
        for line, names in imports(ast.parse(file.read_text(encoding="utf-8"))):
            used = {name for name in names if name in modules and name != "razy"}
            # `from razy.read import file` names the module, not the room's front.
            uses[module] |= used - ({names[0]} if len(used) > 1 else set())
            for name in sorted({name.split(".")[1] for name in used}):
                if room and name != room and name not in BASE | LAYERS.get(room, set()):
                    found.append(f"{place}:{line}: layers: {room} must not use {name}")
            if names[0] == "subprocess" and room != STARTS_PROCESSES:
                found.append(f"{place}:{line}: processes: only {STARTS_PROCESSES} starts them")
            if names[0] in ("razy_post", "."):
                found.append(f"{place}:{line}: names: modules are named from razy on")
    return found + [
        f"{modules[module].relative_to(root)}:1: circle: {' -> '.join(way)}" for module, way in circles(uses)
    ]


def circles(uses: dict[str, set[str]]) -> Iterator[tuple[str, list[str]]]:
    """Each module from which imports lead back to it, with the shortest way."""
    for module in uses:
        ways = [[module]]
        known = set()
        while ways:
            way = ways.pop(0)
            for name in sorted(uses[way[-1]]):
                if name == module:
                    yield module, [*way, name]
                    ways = []
                    break
                if name not in known:
                    known.add(name)
                    ways.append([*way, name])
