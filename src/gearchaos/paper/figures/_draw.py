"""The picture of a figure of the paper, from its settings and Datasets."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from io import BytesIO

import matplotlib
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from gearchaos.paper.figures import _diagrams, _motions, _planes, _system
from gearchaos.paper.figures._style import STYLE
from gearchaos.paper.settings import FigureSettings

Layout = Callable[[Figure, FigureSettings, Mapping[str, xr.Dataset]], None]
LAYOUTS: dict[str, Layout] = {
    "system": _system.system,
    "maps": _planes.maps,
    "basins": _planes.basins,
    "bifurcations": _diagrams.bifurcations,
    "bifurcation_and_exponent": _diagrams.bifurcation_and_exponent,
    "coexisting": _motions.coexisting,
    "portraits": _motions.portraits,
    "dossiers": _motions.dossiers,
    "trajectories_and_portraits": _motions.trajectories_and_portraits,
}
"""A layout draws on an empty figure; add one here and name it in `settings.toml`."""


def draw(setting: FigureSettings, data: Mapping[str, xr.Dataset], dpi: int = 300) -> bytes:
    """The figure as PNG.

    Parameters
    ----------
    setting : Figure
        Which figure, with the settings of its panels.
    data : mapping of str to Dataset
        By the names of the setting's studies.
    dpi : int
        Dots per inch; the figure is 7.2 inches wide.
    """
    with matplotlib.rc_context(STYLE):
        figure = Figure(layout="constrained", dpi=dpi)
        LAYOUTS[setting.layout](figure, setting, data)
        return png(figure, dpi)


def png(figure: Figure, dpi: int) -> bytes:
    """A figure as the bytes of a PNG file."""
    buffer = BytesIO()
    FigureCanvasAgg(figure)
    layout = figure.get_layout_engine()
    assert layout is not None
    layout.execute(figure)  # a second pass beside that of savefig: sizes of Axes and tick labels depend on each other
    figure.savefig(
        buffer, format="png", dpi=dpi, facecolor="white", metadata={"Software": "gearchaos"},
        pil_kwargs={"compress_level": 3},  # faster than the default 6, and smaller files for these pictures
    )
    return buffer.getvalue()
