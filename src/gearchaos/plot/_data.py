"""The data of a figure: which Datasets it shows, and files of them beside the picture."""

from __future__ import annotations

import io
import os
from collections import Counter
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any, ParamSpec, TypeVar
from weakref import WeakKeyDictionary

import xarray as xr
from matplotlib import rc_context, rcParams, rcParamsDefault
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gearchaos.datasets import netcdf_bytes
from gearchaos.errors import InputError
from gearchaos.files import check_target, write_bytes

P = ParamSpec("P")
Drawn = TypeVar("Drawn", bound=Axes | Figure)

SUFFIXES = (".png", ".pdf", ".svg")
"""Suffixes of pictures."""

_SAVING: tuple[Any, ...] = ("savefig.dpi", "pdf.fonttype", "svg.fonttype", "hatch.linewidth")
"""The settings of matplotlib of a style that matter when a picture is saved."""

_DATASETS: WeakKeyDictionary[Figure, list[xr.Dataset]] = WeakKeyDictionary()
"""The Datasets that each figure shows, in the order in which they were drawn."""

_SETTINGS: WeakKeyDictionary[Figure, Any] = WeakKeyDictionary()
"""Those of the settings `_SAVING` that were not matplotlib's defaults when each figure was drawn."""


def keeps_data(draw: Callable[P, Drawn]) -> Callable[P, Drawn]:
    """Let a picture, whose first argument is a Dataset, note for `save_with_data` what it shows and in which style."""

    @wraps(draw)
    def drawn(*args: P.args, **kwargs: P.kwargs) -> Drawn:
        artist = draw(*args, **kwargs)
        figure, dataset = _figure(artist), args[0] if args else kwargs["ds"]
        known = _DATASETS.setdefault(figure, [])
        _SETTINGS.setdefault(figure, {n: rcParams[n] for n in _SAVING if rcParams[n] != rcParamsDefault[n]})
        if isinstance(dataset, xr.Dataset) and not any(dataset is other for other in known):
            known.append(dataset)
        return artist

    return drawn


def _figure(shown: Axes | Figure) -> Figure:
    """The whole figure to which an Axes or a part of a figure belongs."""
    figure = shown.get_figure(root=True)
    assert isinstance(figure, Figure)
    return figure


def save_with_data(shown: Axes | Figure, path: str | os.PathLike[str]) -> list[Path]:
    """Save a picture, and beside it the data that it shows as NetCDF files.

    The picture is saved in the style in which it was drawn, also after the block of `style`. From the data
    `gearchaos.load` and `gearchaos.plot.result` make it again, and readers of a paper can plot it in another way. Each
    file contains the model, the settings and the versions of packages.

    Parameters
    ----------
    shown : Axes or Figure
        Drawn by functions of `gearchaos.plot` that take a Dataset.
    path : path
        The picture: .png, .pdf or .svg. The data of ``map.pdf`` are ``map.nc``, or if there are several Datasets
        ``map-basins.nc``, ``map-manifolds.nc``, ..., by the study of each; older files are replaced.

    Returns
    -------
    list of Path
        The files written, the picture first.

    Raises
    ------
    InputError
        If the figure shows no Dataset, or the path has another suffix or cannot be written to.

    Examples
    --------
    >>> import tempfile
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(kind="single", omega=0.8, eps1=0.1)
    >>> ax = gc.plot.history(gc.simulate(model, 4, samples=32))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     print([file.name for file in gc.plot.save_with_data(ax, f"{folder}/motion.svg")])
    ['motion.svg', 'motion.nc']
    """
    if not isinstance(shown, (Axes, Figure)):
        raise InputError("shown", "must be an Axes or a Figure", f"a {type(shown).__name__}")
    target, figure = Path(path), _figure(shown)
    if target.suffix.lower() not in SUFFIXES:
        raise InputError("path", f"must end in {', '.join(SUFFIXES)}", str(target))
    datasets = _DATASETS.get(figure, [])
    if not datasets:
        raise InputError("shown", "must show a Dataset", "a figure without one",
                         "Pictures of models and designs are made of their parameters; figure.savefig saves them.")
    studies = [str(ds.attrs.get("study", "data")) for ds in datasets]
    several, names = Counter(studies), [target.with_suffix(".nc")]
    if len(datasets) > 1:  # Datasets of the same study are numbered
        numbers = [f"-{studies[: i + 1].count(study)}" if several[study] > 1 else "" for i, study in enumerate(studies)]
        names = [target.with_name(f"{target.stem}-{study}{n}.nc") for study, n in zip(studies, numbers, strict=True)]
    files = dict(zip(names, map(netcdf_bytes, datasets), strict=True))
    picture = io.BytesIO()
    with rc_context(_SETTINGS[figure]):
        figure.savefig(picture, format=target.suffix[1:].lower())
    files = {target: picture.getbuffer(), **files}
    for file in files:
        check_target("path", file)
    for file, content in files.items():
        write_bytes(file, content)
    return list(files)
