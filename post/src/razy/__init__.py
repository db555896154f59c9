"""razy in Python: run its programs, look at what they found.

``razy.run("gear_pair.nml", {"rotation%speed_rpm": 1500})`` runs ``razy-run`` and returns an `xarray.Dataset`;
``ds.razy.plot()`` draws the picture that fits it. What goes wrong is a `razy.Error` with one line.
"""

from importlib import import_module
from typing import Any

from razy.errors import ResultError as Error
from razy.version import __version__

# Commands that read or draw do not wait for xarray: what needs it is loaded when it is asked for.
_PLACES = dict.fromkeys(("duel", "follow", "modes", "run", "sweep", "tune"), "calls") | {
    "import_ross": "tools.ross",
    "open": "results",
    "write_case": "programs.case",
}

__all__ = ["Error", "__version__", *_PLACES]


def __getattr__(name: str) -> Any:
    if name in _PLACES:
        return getattr(import_module(f"razy.{_PLACES[name]}"), {"open": "open_result"}.get(name, name))
    if name in ("check", "plot", "programs", "read", "report", "tools", "view"):
        return import_module(f"razy.{name}")
    raise AttributeError(f"module 'razy' has no attribute '{name}'")


def __dir__() -> list[str]:
    return __all__
