"""The group ``/scene`` of a result file: the geometry of a machine, in its reference position."""

from dataclasses import dataclass

import h5py
import numpy as np
from numpy.typing import NDArray

from razy.errors import ResultError
from razy.read.file import ResultFile, meanings, text


@dataclass(frozen=True)
class Body:
    """A rigid body: centre of mass and size in m; size 0 where the input gives none."""

    name: str
    centre: NDArray[np.float64]
    size: NDArray[np.float64]


@dataclass(frozen=True)
class Point:
    """A named point; body from 1, 0 is the frame."""

    name: str
    body: int
    position: NDArray[np.float64]


@dataclass(frozen=True)
class Element:
    """What stands between two points, or acts at one: kind in words, bodies at both ends, ends in m, direction."""

    name: str
    kind: str
    bodies: tuple[int, int]
    first: NDArray[np.float64]
    second: NDArray[np.float64]
    direction: NDArray[np.float64]


@dataclass(frozen=True)
class Scene:
    """Bodies, points and elements of a machine in a plane."""

    bodies: tuple[Body, ...]
    points: tuple[Point, ...]
    elements: tuple[Element, ...]


def read_scene(result: ResultFile) -> Scene:
    """Read the geometry of a machine; a file without one is a `ResultError`."""
    group = result.file.get("scene")
    if not isinstance(group, h5py.Group):
        raise ResultError(f"{result.path}: the file holds no geometry of the machine (only one with a &body has one)")
    try:
        bodies = zip(_texts(group["body"]), group["centre"][()], group["size"][()], strict=True)
        points = zip(_texts(group["point"]), group["point_body"][()].tolist(), group["position"][()], strict=True)
        elements = _elements(group) if "kind" in group else ()
        return Scene(tuple(Body(*row) for row in bodies), tuple(Point(*row) for row in points), elements)
    except (KeyError, ValueError) as cause:
        raise ResultError(f"{result.path}: the geometry of the machine is incomplete ({cause})") from cause


def _elements(group: h5py.Group) -> tuple[Element, ...]:
    words = meanings(group["kind"])
    kinds = (words.get(number, "") for number in group["kind"][()].tolist())
    bodies = zip(group["first_body"][()].tolist(), group["second_body"][()].tolist(), strict=True)
    ends = (group[name][()] for name in ("first", "second", "direction"))
    return tuple(Element(*row) for row in zip(_texts(group["element"]), kinds, bodies, *ends, strict=True))


def _texts(item: h5py.Dataset) -> list[str]:
    return [text(value) for value in item[()].flat]
