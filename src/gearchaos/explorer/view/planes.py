"""The parameter planes that the explorer's map can show."""

from __future__ import annotations

from functools import cache

from gearchaos.explorer.view.bounds import HIGHEST_HARMONIC, MAP_CELLS
from gearchaos.explorer.view.gears import gear_values
from gearchaos.gears.operating import OperatingModel
from gearchaos.model import COORDINATES, MeshModel, has_effect, known_names, state_names
from gearchaos.quantities import OPERATION, parse_harmonic
from gearchaos.studies.axis import Axis


@cache
def figure_plane(number: int) -> tuple[Axis, Axis]:
    """The horizontal and the vertical axis of a figure of the paper that is a map."""
    from gearchaos.paper.settings import all_figures  # here, since worker processes import this module

    axes = next(iter(all_figures()[number].studies.values())).axes
    x, y = (Axis(n, r.start, r.stop, count) for (n, r), count in zip(axes.items(), MAP_CELLS, strict=True))
    return x, y


def axis_names(model: MeshModel) -> list[str]:
    """Parameters that an axis of the map can scan.

    A pair stands in place of its two members; parameters that have no effect on this kind of model are left out, and
    so are initial values. The harmonics listed are those that the model has, and at least the first.
    """
    out = [q.name for q in OPERATION] if isinstance(model, OperatingModel) else []
    for name in [*known_names(model), *(n for n in model.parameters() if n not in known_names(model))]:
        order = ((parts := parse_harmonic(name)) is not None and parts.order) or 0
        if order <= HIGHEST_HARMONIC and has_effect(name, model.kind) and name not in {*state_names(model.kind), *out}:
            out.append(name)
    return out


def initial_values(model: MeshModel) -> dict[str, float]:
    """Every coordinate of a model at τ = 0, by name: as given, otherwise x1 = 1 and all others 0, as in the paper."""
    return {n: 1.0 if n == "x1" else 0.0 for n in COORDINATES[model.kind]} | dict(model.initial)


def value_on(model: MeshModel, axis: Axis) -> float:
    """The value that the model has for the parameter of an axis, or the middle of the axis if it has no single value.

    A pair has no single value if its two members differ.
    """
    if isinstance(model, OperatingModel) and axis.name in gear_values(model):
        return gear_values(model)[axis.name]
    known = model.parameters() | initial_values(model)
    missing = dict.fromkeys(state_names(model.kind))  # None for z, which follows from x1, x2, ... and is not in `known`
    values = {known.get(n, missing.get(n, 0.0)) for n in model.set_by(axis.name)}  # an absent harmonic is 0
    first = values.pop()
    return (axis.start + axis.stop) / 2 if first is None or values else first
