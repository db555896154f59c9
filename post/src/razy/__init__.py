"""razy in Python: run its programs, look at what they found.

``razy.run("gear_pair.nml", {"rotation%speed_rpm": 1500})`` runs ``razy-run`` and returns an `xarray.Dataset`;
``ds.razy.plot()`` draws the picture that fits it. What goes wrong is a `razy.Error` with one line.
"""

from razy.case import write_case
from razy.programs import duel, follow, modes, run, sweep, tune
from razy.results import open_result as open  # noqa: A004
from razy.ross import import_ross
from razy_post import __version__
from razy_post.errors import ResultError as Error

__all__ = [
    "Error",
    "__version__",
    "duel",
    "follow",
    "import_ross",
    "modes",
    "open",
    "run",
    "sweep",
    "tune",
    "write_case",
]
