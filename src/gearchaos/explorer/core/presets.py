"""The figures of the 2008 paper as presets of a page; their settings are those of `gearchaos.paper`."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

from gearchaos.explorer.core.bounds import MAP_CELLS
from gearchaos.explorer.core.state import View, view_of
from gearchaos.gears.operation.operating import gears_of
from gearchaos.model import MeshModel
from gearchaos.paper.settings import FigureStudy, all_figures
from gearchaos.quantities import quantity
from gearchaos.studies.core.axis import Axis


@dataclass(frozen=True)
class Preset:
    """One part of a figure of the paper, by its number and title; its basins are computed at once if it shows some."""

    name: str
    view: View
    basins: bool = False


@cache
def presets() -> dict[str, Preset]:
    """Presets by key, e.g. "3b", one for each part of each figure, in the order of the paper."""
    out = {}
    for number, figure in all_figures().items():
        studies = {n: s for n, s in figure.studies.items() if not n.endswith("_section")}
        if not studies:  # figure 1, a drawing of the gear pair
            out[str(number)] = Preset(f"Figure {number}: {figure.title}", view_of(MeshModel()))
        for name, study in studies.items():
            key = f"{number}{name if len(studies) > 1 else ''}"
            title = f"Figure {key}: {figure.title}"
            if len(studies) > 1:  # with the values in which the parts differ
                others = [s.model for s in figure.studies.values()]
                own = [n for n in study.model if any(other.get(n) != study.model[n] for other in others)]
                title += f", {', '.join(f'{quantity(n).symbol} = {study.model[n]:g}' for n in own)}"
            out[key] = Preset(title, _view(study), study.kind == "basins")
    return out


def preset_of(view: View, last: str = "") -> str:
    """The key of the preset that a view shows, or "" if it shows none.

    ``last`` is the preset chosen last. It stays chosen while the point moves in its plane; any other preset is
    recognised only at its own point.
    """
    def plane(view: View) -> tuple[object, ...]:
        """Kind of model, the two parameters of the map, and the values of all others; not the ranges of the map."""
        model, names = view.model, (view.x.name, view.y.name)
        scanned = model.expand(dict.fromkeys(names))
        kept = {n: v for n, v in (model.parameters() | dict(model.initial)).items() if n not in scanned}
        return model.kind, names, kept

    if gears_of(view.model) is not None:
        return ""
    matching = [key for key, preset in presets().items() if plane(preset.view) == plane(view)]
    return last if last in matching else next((key for key in matching if presets()[key].view.at == view.at), "")


def _view(study: FigureStudy) -> View:
    """The view of a study.

    A map is shown as a map. A bifurcation diagram is shown along the vertical line through a point of the map over its
    parameter and the mesh frequency, a single motion as a point of the map of figure 2.
    """
    model = study.mesh_model
    scanned = {n: r for n, r in study.axes.items() if n not in model.state_names}
    view = view_of(model)
    if len(scanned) == 2:
        x, y = (Axis(n, r.start, r.stop, c) for (n, r), c in zip(scanned.items(), MAP_CELLS, strict=True))
        return replace(view, x=x, y=y, at=((x.start + x.stop) / 2, (y.start + y.stop) / 2))
    for name, r in scanned.items():
        y = Axis(name, r.start, r.stop, MAP_CELLS[1])
        return replace(view, y=y, at=(view.at[0], (r.start + r.stop) / 2), line="y")
    return view
