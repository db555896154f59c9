"""The patches of bench/ablation.py fit the sources; one that does not is found."""

from __future__ import annotations

import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "bench"))
from harness import variants  # noqa: E402


class AblationPatches(unittest.TestCase):
    def test_all_fit(self):
        self.assertEqual(variants.misfits(), [])
        self.assertGreater(sum(len(variant.patches) for variant in variants.VARIANTS), 20)

    def test_misfits_are_found(self):
        first = variants.Patch("a.f90", "one", "two")
        twice = variants.Variant("twice", "", [first, first])
        absent = variants.Variant("absent", "", [variants.Patch("b.f90", "one", "two")])
        several = variants.Variant("several", "", [variants.Patch("a.f90", "n", "m", 2)])
        fits = variants.Variant("fits", "", [first, variants.Patch("a.f90", "two", "x")])
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "a.f90").write_text("one", encoding="utf-8")
            found = variants.misfits([twice, absent, several, fits], Path(folder))
            self.assertEqual((Path(folder) / "a.f90").read_text(encoding="utf-8"), "one")
        self.assertEqual([line.split(":")[0] for line in found], ["twice", "absent", "several"])


if __name__ == "__main__":
    unittest.main()
