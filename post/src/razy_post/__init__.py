"""The former name of `razy.read` and `razy.plot`; it goes with the next release."""

import sys
import warnings

from razy import plot as plot
from razy import read as read
from razy.version import __version__ as __version__

warnings.warn("razy_post is now razy: write razy.read for razy_post.read", DeprecationWarning, stacklevel=2)
for _name, _module in list(sys.modules.items()):
    if _name.startswith(("razy.errors", "razy.plot", "razy.read")):
        sys.modules[_name.replace("razy", __name__, 1)] = _module
