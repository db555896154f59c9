"""The package: its former name, and what its commands wait for."""

import subprocess
import sys
from pathlib import Path

import pytest

import razy
from razy.read.file import Quantity

SOURCE = Path(razy.__file__).parents[1]


def test_the_former_name_warns_and_is_the_same():
    with pytest.warns(DeprecationWarning, match=r"write razy\.read for razy_post\.read"):
        import razy_post
    from razy_post.read import file

    assert file.Quantity is Quantity and razy_post.plot is razy.plot
    assert razy_post.__version__ == razy.__version__


def test_every_name_is_there_and_commands_do_not_wait_for_xarray():
    assert all(getattr(razy, name) is not None for name in dir(razy))
    with pytest.raises(AttributeError, match="no attribute 'rum'"):
        _ = razy.rum
    code = "import sys, razy.plot.cli, razy.tools.cli; sys.exit('xarray' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], cwd=SOURCE).returncode == 0
