"""What a user hands to a call: of the kind that its annotations ask for, or one line that says so."""

import functools
import inspect
import reprlib
from collections.abc import Callable, Mapping
from typing import Any, ParamSpec, TypeVar

import numpy as np
from typeguard import CollectionCheckStrategy, TypeCheckError, check_type

from razy.errors import ResultError, of_system, one_line

P = ParamSpec("P")
R = TypeVar("R")


def checked(function: Callable[P, R]) -> Callable[P, R]:
    """Check the arguments of a function by their annotations; raise what goes wrong as a `ResultError` of one line."""
    signature = inspect.signature(function)
    # What is returned may be named only, so that its package is not imported for it.
    kinds = {name: kind for name, kind in function.__annotations__.items() if name != "return"}

    @functools.wraps(function)
    def call(*given: P.args, **named: P.kwargs) -> R:
        try:
            arguments = signature.bind(*given, **named).arguments
        except TypeError as error:
            raise ResultError(f"razy: {error}") from None
        check({name: value for name, value in arguments.items() if name != "options"}, kinds)
        try:
            return function(*given, **named)
        except (ResultError, OSError) as cause:
            # Names of files and of groups may be anything, and too long for the system.
            error = of_system(cause) if isinstance(cause, OSError) else cause
            raise type(error)(one_line(str(error))) from cause.__cause__

    return call


def check(values: Mapping[str, Any], kinds: Mapping[str, Any]) -> None:
    """Raise a `ResultError` that names the first value that is not of its kind."""
    for name, value in values.items():
        if name not in kinds:
            continue
        plain = value.item() if isinstance(value, np.generic) else value
        try:
            check_type(plain, kinds[name], collection_check_strategy=CollectionCheckStrategy.ALL_ITEMS)
        except TypeCheckError as error:
            raise ResultError(one_line(f"{name}={reprlib.repr(value)}: {' '.join(str(error).split())}")) from None
