"""The figures of the paper as places to start from, out of the same data that the report draws them from."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

from gearchaos.explorer.bounds import CELLS
from gearchaos.explorer.state import View, standard
from gearchaos.model import MeshModel, expand, state_names
from gearchaos.paper.settings import Figure, FigureStudy, all_figures
from gearchaos.studies.axis import Axis


@dataclass(frozen=True)
class Preset:
    """One part of a figure of the paper: its name, what the page shows of it, and whether its basins belong to it."""

    name: str
    view: View
    basins: bool = False


@cache
def presets() -> dict[str, Preset]:
    """Every part of every figure by a short key, e.g. "3b", in the order of the paper."""
    out = {}
    for number, figure in all_figures().items():
        studies = {n: s for n, s in figure.studies.items() if not n.endswith("_section")}
        if not studies:  # the system itself
            out[str(number)] = Preset(f"Figure {number}: {figure.title}", standard(MeshModel()))
        for name, study in studies.items():
            key = f"{number}{name if len(studies) > 1 else ''}"
            title = f"Figure {key}: {_title(figure, study, len(studies))}"
            out[key] = Preset(title, _view(study), study.kind == "basins")
    return out


def preset_of(view: View, before: str = "") -> str:
    """The key of the preset on show, or "": the one before as long as its plane is kept, else the one of this point."""
    alike = [key for key, preset in presets().items() if _plane(preset.view) == _plane(view)]
    if before in alike:
        return before
    return next((key for key in alike if presets()[key].view.at == view.at), "")


def _plane(view: View) -> tuple[object, ...]:
    """The parameters scanned, whatever part of the plane is in view, and the values of all others."""
    model, names = view.model, (view.x.name, view.y.name)
    scanned = expand(dict.fromkeys(names), model)
    kept = {n: v for n, v in (model.parameters() | dict(model.initial)).items() if n not in scanned}
    return model.kind, names, kept


@cache
def plane_of(number: int) -> tuple[Axis, Axis]:
    """The two axes of a figure that is a map."""
    axes = next(iter(all_figures()[number].studies.values())).axes
    x, y = (Axis(n, r.start, r.stop, count) for (n, r), count in zip(axes.items(), CELLS, strict=True))
    return x, y


def _title(figure: Figure, study: FigureStudy, parts: int) -> str:
    """The figure's title, with the values that tell its parts apart."""
    if parts == 1:
        return figure.title
    others = [s.model for s in figure.studies.values()]
    own = [n for n in study.model if any(other.get(n) != study.model[n] for other in others)]
    return f"{figure.title}, {', '.join(f'{n} = {study.model[n]:g}' for n in own)}"


def _view(study: FigureStudy) -> View:
    """A map as it is; a diagram as the vertical line through a map of it over frequency; a point in figure 2's map."""
    model = study.mesh_model
    scanned = {n: r for n, r in study.axes.items() if n not in state_names(model.kind)}
    view = standard(model)
    if len(scanned) == 2:
        x, y = (Axis(n, r.start, r.stop, c) for (n, r), c in zip(scanned.items(), CELLS, strict=True))
        return replace(view, x=x, y=y, at=((x.start + x.stop) / 2, (y.start + y.stop) / 2))
    for name, r in scanned.items():
        y = Axis(name, r.start, r.stop, CELLS[1])
        return replace(view, y=y, at=(view.at[0], (r.start + r.stop) / 2), line="y")
    return view
