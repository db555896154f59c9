"""Pictures of a machine in its reference position: planar scenes and rotors to scale, lumped ones as a scheme."""

from matplotlib.figure import Figure

from razy.errors import ResultError
from razy.plot.machine import lumped, planar, rotor
from razy.plot.options import PlotOptions
from razy.read import ResultFile
from razy.read.description import read_description


def draw(result: ResultFile, figure: Figure, options: PlotOptions) -> None:
    """Draw the machine of a result file, from its geometry or, of lumped scenes and rotors, from its input.

    Parameters
    ----------
    result
        Open result file.
    figure
        Empty figure.
    options
        Title, size and footer are used.

    Raises
    ------
    ResultError
        The file does not say what the machine looks like.
    """
    if "scene" in result.file:
        planar.draw(result, figure, options)
        return
    description = read_description(result)
    if "shaft" in description:
        rotor.draw(result, description, figure, options)
    elif "mass" in description or "inertia" in description:
        lumped.draw(result, description, figure, options)
    else:
        raise ResultError(f"{result.path}: the file holds no geometry of the machine")
