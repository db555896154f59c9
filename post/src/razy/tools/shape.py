"""Shapes of rotors: deflections of the shafts in modes or in a motion, as animations and for other programs."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.animation import FuncAnimation, HTMLWriter, PillowWriter
from matplotlib.figure import Figure
from numpy.typing import NDArray

from razy.errors import ResultError
from razy.plot import style
from razy.plot.machine.rotor import placed_shafts
from razy.plot.options import PlotOptions
from razy.read import ModesResult, ResultFile, RunResult
from razy.read.description import read_description

# Of the length of the machine, the largest deflection in an animation.
DRAWN = 0.12
FRAMES = 36
FRAMES_A_SECOND = 18


@dataclass(frozen=True)
class Skeleton:
    """The shafts of a rotor as lines in space.

    Attributes
    ----------
    names
        A node each: ``SHAFT.NODE``.
    points
        Places, m, shape (nodes, 3), shafts along x.
    lines
        Pairs of neighbouring nodes, counted from 0, shape (lines, 2).
    """

    names: tuple[str, ...]
    points: NDArray[np.float64]
    lines: NDArray[np.int64]

    def deflections(self, coordinates: tuple[str, ...], values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return displacements along x, y, z, shape (..., nodes, 3), of values (..., coordinates); 0 where not free."""
        place = {name.lower(): number for number, name in enumerate(coordinates)}
        result = np.zeros((*values.shape[:-1], len(self.names), 3))
        for row, name in enumerate(self.names):
            for column, way in enumerate("uvw"):
                if f"{name}.{way}" in place:
                    result[..., row, column] = values[..., place[f"{name}.{way}"]]
        return result


def skeleton(result: ResultFile) -> Skeleton:
    """Return the shafts of a rotor; a file of another scene is a `ResultError`."""
    shafts, _ = placed_shafts(result, read_description(result))
    names, points, lines = [], [], []
    for name, shaft in shafts.items():
        first = len(points)
        names += [f"{name}.{node}" for node in range(1, shaft.nodes.size + 1)]
        points += [(x, shaft.y, 0.0) for x in shaft.nodes]
        lines += [(number, number + 1) for number in range(first, len(points) - 1)]
    return Skeleton(tuple(names), np.array(points), np.array(lines))


def mode_shapes(result: ModesResult, bones: Skeleton) -> NDArray[np.float64]:
    """Return the undamped shapes at rest, shape (modes, nodes, 3)."""
    return bones.deflections(result.coordinates, result.shape)


def write_shapes(result: ResultFile, target: Path) -> str:
    """Write the shapes of modes for VTK (.vtk, .vtu) or XDMF (.xdmf), or a motion over time for XDMF; say what."""
    try:
        import meshio
    except ImportError as cause:
        raise ResultError(
            f"{target}: shapes are written by the package meshio (pip install meshio): {cause}"
        ) from cause
    bones = skeleton(result)
    cells = [("line", bones.lines)]
    if isinstance(result, ModesResult):
        shapes = mode_shapes(result, bones)
        names = [f"mode {k + 1}, {f:.3f} Hz" for k, f in enumerate(result.natural_frequency)]
        # A name with blanks ends early in files of VTK.
        data = {name.replace(", ", "_").replace(" ", "_"): shape for name, shape in zip(names, shapes, strict=True)}
        mesh = meshio.Mesh(bones.points, cells, point_data=data)
        # The numbers go into the file itself, not into an HDF5 file beside it.
        mesh.write(target, **({"data_format": "XML"} if target.suffix == ".xdmf" else {}))
        return f"{len(shapes)} modes"
    if not isinstance(result, RunResult) or target.suffix != ".xdmf":
        raise ResultError(f"{result.path}: {target.suffix} takes shapes of razy-modes (.xdmf also motions of razy-run)")
    with meshio.xdmf.TimeSeriesWriter(target, data_format="XML") as writer:
        writer.write_points_cells(bones.points, cells)
        for time, deflection in _motion(result, bones):
            writer.write_data(time, point_data={"displacement": deflection})
    return f"{result.time.size} times"


def animate(result: ResultFile, target: Path, mode: int, start: float | None, stop: float | None) -> str:
    """Write shafts as they move, as .gif or .html: a mode of razy-modes or a motion of razy-run; say what."""
    bones = skeleton(result)
    if isinstance(result, ModesResult):
        if not 1 <= mode <= len(result.natural_frequency):
            raise ResultError(f"{result.path}: no mode {mode} (has 1 to {len(result.natural_frequency)})")
        shape = mode_shapes(result, bones)[mode - 1]
        frames = [shape * np.cos(2 * np.pi * k / FRAMES) for k in range(FRAMES)]
        titles = [f"mode {mode}, {result.natural_frequency[mode - 1]:.2f} Hz"] * FRAMES
    elif isinstance(result, RunResult):
        part = result.window(start, stop)
        chosen = np.unique(np.linspace(part.start, part.stop - 1, min(4 * FRAMES, part.stop - part.start)).astype(int))
        pairs = list(_motion(result, bones, chosen))
        if len(pairs) < 2:
            raise ResultError(f"{result.path}: fewer than two stored times in the range asked for")
        frames = [deflection for _, deflection in pairs]
        titles = [f"{time:.5g} s" for time, _ in pairs]
    else:
        raise ResultError(f"{result.path}: animations are of modes of razy-modes or motions of razy-run")
    largest = max(float(np.abs(frame).max()) for frame in frames)
    if not largest > 0.0:
        raise ResultError(f"{result.path}: no shaft is deflected")
    scale = DRAWN * np.ptp(bones.points[:, 0]) / largest
    writer = PillowWriter(FRAMES_A_SECOND) if target.suffix == ".gif" else _page_writer()
    with style.look():
        _animation(result, bones, [scale * frame for frame in frames], titles).save(target, writer=writer)
    return f"{len(frames)} pictures"


def _motion(
    result: RunResult, bones: Skeleton, rows: NDArray[np.int64] | None = None
) -> Iterator[tuple[float, NDArray[np.float64]]]:
    if not result.has_trajectory or not result.coordinates:
        raise ResultError(f"{result.path}: a motion of the shafts needs &record observable='state', what='trajectory'")
    if not {name.lower().rpartition(".")[0] for name in result.coordinates} & set(bones.names):
        raise ResultError(f"{result.path}: its coordinates are not those of nodes; compute it without &reduction")
    state, time = result.file["state/displacement"], result.time
    for row in range(time.size) if rows is None else rows:
        yield float(time[row]), bones.deflections(result.coordinates, state[row])


def _page_writer() -> HTMLWriter:
    return HTMLWriter(fps=FRAMES_A_SECOND, embed_frames=True, default_mode="loop")


def _animation(
    result: ResultFile, bones: Skeleton, frames: list[NDArray[np.float64]], titles: list[str]
) -> FuncAnimation:
    figure = Figure(figsize=(16.0 * style.CM, 10.0 * style.CM), dpi=110)
    style_of = {"color": style.BLACK, "linewidth": 1.4, "marker": "o", "markersize": 2.5, "clip_on": False}
    axes = figure.add_axes((0.0, 0.0, 1.0, 0.95), projection="3d")
    moving = []
    for first, last in bones.lines:
        # Shafts along x lie across, y is up: matplotlib's third axis is up.
        x, y, z = bones.points[[first, last]].T
        axes.plot(x, z, y, color=style.GREY, linewidth=0.6, linestyle="--", clip_on=False)
        moving.append(axes.plot(x, z, y, **style_of)[0])
    reach = DRAWN * np.ptp(bones.points[:, 0])
    lows, highs = bones.points.min(axis=0) - reach, bones.points.max(axis=0) + reach
    axes.set(xlim=(lows[0], highs[0]), ylim=(lows[2], highs[2]), zlim=(lows[1], highs[1]))
    axes.set_box_aspect((highs - lows)[[0, 2, 1]], zoom=1.35)
    axes.set_axis_off()
    title = figure.suptitle("")

    def show(number: int) -> list:
        places = bones.points + frames[number]
        for line, (first, last) in zip(moving, bones.lines, strict=True):
            x, y, z = places[[first, last]].T
            line.set_data_3d(x, z, y)
        title.set_text(f"{style.title_of(result, PlotOptions())}: {titles[number]}")
        return [*moving, title]

    return FuncAnimation(figure, show, frames=len(frames))
