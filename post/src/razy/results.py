"""Results as `xarray.Dataset`, with the pictures of ``razy-plot`` as ``ds.razy.plot``."""

from collections.abc import Sequence
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Any

import xarray
from matplotlib.figure import Figure

from razy import read
from razy.arguments import checked
from razy.errors import ResultError
from razy.plot import ARRANGEMENTS, KINDS, PICTURES, PlotOptions, draw_files, output, style
from razy.plot.options import RESOLUTIONS
from razy.read.file import making_sense_of
from razy.target import check_output
from razy.tools.export import export


@checked
def open_result(file: str | Path) -> xarray.Dataset:
    """Open a result file of any of razy's programs.

    Parameters
    ----------
    file
        HDF5 file.

    Returns
    -------
    xarray.Dataset
        Variables with ``units`` and ``long_name``; large ones are read when they are looked at, so the file has to
        stay where it is. Attributes say where all comes from: ``program``, ``razy_version``, ``git_commit``,
        ``input`` (the whole namelist with its defaults), and ``source``, the path of the file.

    Raises
    ------
    razy.Error
        The file does not exist, is damaged, or is not one of razy.
    """
    with read.open_result(Path(file).absolute()) as result, making_sense_of(file):
        return result.to_xarray().assign_attrs(source=result.path)


class Picture(Figure):
    """A figure that a notebook shows."""

    def _repr_png_(self) -> bytes:
        file = BytesIO()
        with style.look():
            self.savefig(file, format="png")
        return file.getvalue()


class Plot:
    """The pictures of a result: ``ds.razy.plot()`` the one that fits, ``ds.razy.plot.phase(coordinate="x")`` others.

    Options are those of ``razy-plot``: ``observable`` and ``coordinate`` (a name or several), ``start`` and ``stop``
    (range of the parameter, or of time in s), ``quantity``, ``top``, ``title``, ``size`` (width and height in cm),
    ``footer``, ``dpi``, ``save`` (file to write) with ``force``; ``beside`` takes other results for the same picture,
    with ``labels`` and ``arrange``. They draw what is in the file, whatever was selected from the dataset since.
    """

    def __init__(self, data: xarray.Dataset) -> None:
        self._data = data

    def __dir__(self) -> list[str]:
        """Return the kinds of pictures that the result has."""
        program = self._data.attrs.get("program")
        return [picture.kind.replace("-", "_") for picture in PICTURES if picture.program == program]

    def __getattr__(self, kind: str) -> partial[Picture]:
        if kind not in {picture.kind.replace("-", "_") for picture in PICTURES}:
            raise AttributeError(f"no picture of the kind '{kind}' (has: {', '.join(dir(self))})")
        return partial(self, kind.replace("_", "-"))

    @checked
    def __call__(
        self,
        kind: str | None = None,
        *,
        observable: str | Sequence[str] = (),
        coordinate: str | Sequence[str] = (),
        beside: xarray.Dataset | Sequence[xarray.Dataset] = (),
        labels: Sequence[str] = (),
        arrange: str = "overlay",
        dpi: int = 150,
        save: str | Path | None = None,
        force: bool = False,
        **options: Any,
    ) -> Picture:
        """Draw a picture of the kind asked for."""
        if kind not in (None, *KINDS):
            raise ResultError(f"ds.razy.plot: no picture of the kind '{kind}' (has: {', '.join(dir(self))})")
        if arrange not in ARRANGEMENTS:
            raise ResultError(f"arrange='{arrange}': one of {', '.join(ARRANGEMENTS)}")
        if not RESOLUTIONS[0] <= dpi <= RESOLUTIONS[1]:
            raise ResultError(f"dpi={dpi}: a whole number from {RESOLUTIONS[0]} to {RESOLUTIONS[1]}")
        several = [self._data, *([beside] if isinstance(beside, xarray.Dataset) else beside)]
        files = [source_of(data) for data in several]
        if save is not None:
            output.check_target(Path(save), [Path(file) for file in files], force)
        try:
            chosen = PlotOptions(observables=_names(observable), coordinates=_names(coordinate), **options)
        except TypeError as error:
            raise ResultError(f"ds.razy.plot: {str(error).split('__init__() ')[-1]}") from None
        figure = Picture(dpi=dpi)
        results = [read.open_result(file) for file in files]
        try:
            draw_files(results, figure, chosen, kind, labels, arrange)
            if save is not None:
                output.save(figure, Path(save), style.provenance(results[0]))
        finally:
            for result in results:
                result.close()
        return figure


@xarray.register_dataset_accessor("razy")
class Accessor:
    """What razy adds to a dataset: ``ds.razy.plot``, ``ds.razy.open()``."""

    def __init__(self, data: xarray.Dataset) -> None:
        self._data = data

    @property
    def plot(self) -> Plot:
        """The pictures."""
        return Plot(self._data)

    @checked
    def export(self, file: str | Path, force: bool = False, **options: Any) -> Path:
        """Write the result for other programs by the suffix of `file`; see `razy.tools.export.export` for options."""
        target = Path(file)
        with self.open() as result:
            check_output(target, [Path(result.path)], force)
            export(result, target, **options)
        return target

    def open(self) -> read.ResultFile:
        """Open the file of this result by the reader of its program, for what a dataset does not offer; close it."""
        return read.open_result(source_of(self._data))


def source_of(data: xarray.Dataset) -> str:
    """Return the file that a dataset comes from."""
    if not isinstance(data.attrs.get("source"), str):
        raise ResultError("this dataset was not opened by razy.open, or has lost its attribute 'source'")
    return data.attrs["source"]


def _names(given: str | Sequence[str]) -> tuple[str, ...]:
    return (given,) if isinstance(given, str) else tuple(given)
