"""Every rule of check_python.py is broken once in a small package; what is allowed is not."""

from __future__ import annotations

import tempfile
import unittest
from pathlib import Path

from check_python import PACKAGE, check_python

GOOD = {
    "__init__.py": "from razy.version import __version__\n",
    "version.py": "__version__ = '0'\n",
    "read/__init__.py": "from razy.read.file import open_file\n",
    "read/file.py": "import h5py\nfrom razy.version import __version__\n",
    "plot/__init__.py": "from razy.plot import style\n",
    "plot/style.py": "from razy.read import file\n",
    "programs/process.py": "import subprocess\n",
    "view/page.py": "def f():\n    from razy.plot import style\n",
}
BAD = [
    ("read/file.py", "from razy.plot.style import look", "read/file.py:1: layers: read must not use plot"),
    ("plot/style.py", "def f():\n    import razy.view.page", "plot/style.py:2: layers: plot must not use view"),
    ("version.py", "from razy import read", "version.py:1: layers: version must not use read"),
    ("new/a.py", "from razy.read import file", "new/a.py:1: layers: new must not use read"),
    ("view/page.py", "from subprocess import run", "view/page.py:1: processes: only programs starts them"),
    ("view/page.py", "from . import cli", "view/page.py:1: names: modules are named from razy on"),
    ("view/page.py", "from razy_post import read", "view/page.py:1: names: modules are named from razy on"),
    (
        "read/file.py",
        "def f():\n    from razy.read import open_file",
        "read/__init__.py:1: circle: razy.read -> razy.read.file -> razy.read",
    ),
]


def breaches(package: dict[str, str]) -> list[str]:
    """What check_python says of a package of these files, without the folder."""
    with tempfile.TemporaryDirectory() as folder:
        for name, text in package.items():
            path = Path(folder) / PACKAGE / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        return [line.removeprefix(f"{PACKAGE}/") for line in check_python(Path(folder))]


class CheckPython(unittest.TestCase):
    def test_allowed(self):
        self.assertEqual(breaches(GOOD), [])

    def test_every_breach(self):
        for name, text, line in BAD:
            with self.subTest(name=name, text=text):
                self.assertIn(line, breaches(GOOD | {name: f"{text}\n"}))


if __name__ == "__main__":
    unittest.main()
