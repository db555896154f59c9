"""Pages with mistakes, and what check_docs.py says of them."""

from __future__ import annotations

import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import check_docs

TREE = {
    "src/core/text.f90": "module razy_core_text\nend module\n",
    "src/linalg/dense.f90": "module razy_linalg_dense\n use razy_core_text, only: join_all\nend module\n",
    "src/study/run.f90": "module a\n use razy_linalg_dense, only: b\n use razy_core_text, only: c\nend module\n",
    "drivers/razy_run.f90": "program r\n use razy_study_run, only: d\nend program\n",
}
EDGES = ["drivers --> study", "linalg --> core", "study --> linalg"]


class Pages(unittest.TestCase):
    def said(self, page: str) -> list[str]:
        """What is said of a page of a small tree."""
        with tempfile.TemporaryDirectory() as folder:
            root = Path(folder)
            for name, text in (TREE | {"docs/page.md": page}).items():
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (root / name).write_text(text, encoding="utf-8")
            return [line.removeprefix("docs/page.md:") for line in check_docs.check_docs(root)]

    def test_good_page(self):
        self.assertEqual(
            self.said("# A. Title\n\nOne e.g. Two by Š. Dyk.\nThree.\n\n| a. B | c |\n\n```\na. B\n```\n"), []
        )
        self.assertEqual(
            self.said("1. One.\n   Two `core/text`, `src/linalg`, `join_all`, `text.f90`.\n\n    a. B\n"), []
        )

    def test_sentences_and_columns(self):
        self.assertEqual(self.said("One. Two.\n"), ["1: sentence: a second sentence on the line"])
        self.assertEqual(self.said("- One.\n- Two (`x`). *Three*.\n"), ["2: sentence: a second sentence on the line"])
        self.assertEqual(self.said("x" * 161), ["1: columns: 161 columns, more than 160"])

    def test_names(self):
        self.assertEqual(self.said("Here `linalg/sparse`.\n"), ["1: name: there is no linalg/sparse"])
        self.assertEqual(self.said("| `join_none` |\n"), ["1: name: nothing is called join_none"])
        for good in ("src/core/<what>.f90", "src/*/text.f90", "text.f90", "src/core/"):
            self.assertEqual(self.said(f"Here `{good}`.\n"), [])
        for bad in ("src/core/txt.f90", "src/io/*.f90", "src/<room>/dens.f90", "txt.f90", "src/io/", "docs/a<what>.md"):
            self.assertEqual(self.said(f"Here `{bad}`.\n"), [f"1: name: there is no {bad}"])
        self.assertEqual(self.said("`join_all` in `src/linalg/dense.f90`\n"), [])
        self.assertEqual(
            self.said("`join_all` of `src/core/text.f90`\n"), ["1: name: src/core/text.f90 has no join_all"]
        )

    def test_picture(self):
        with tempfile.TemporaryDirectory() as folder:
            root = Path(folder)
            page = f"{check_docs.BEGIN}\n{check_docs.END}\n"
            for name, text in (TREE | {"docs/architecture.md": page}).items():
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (root / name).write_text(text, encoding="utf-8")
            self.assertIn("picture", check_docs.check_docs(root)[0])
            check_docs.update(root)
            self.assertEqual(check_docs.check_docs(root), [])
            drawn = (root / "docs/architecture.md").read_text(encoding="utf-8").splitlines()
            self.assertEqual([line.strip() for line in drawn if "-->" in line and "<!--" not in line], EDGES)


if __name__ == "__main__":
    unittest.main()
