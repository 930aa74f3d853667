"""The state of a page: the model, the axes of the map, the point chosen on it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from gearchaos.errors import InputError, unknown_name
from gearchaos.explorer.core import models
from gearchaos.explorer.core.bounds import LEVELS, bounded, finite_number, in_range, rounded
from gearchaos.explorer.core.models import WHEELS, as_kind, axis_names, equal, first_plane, value_on
from gearchaos.explorer.core.run import Run
from gearchaos.gears.operation.operating import Gears, OperatingModel, gears_of
from gearchaos.model import DAMPING_LAWS, KINDS, PARAMETER_PAIRS, STIFFNESS_KINDS, MeshModel, check_is_pair
from gearchaos.quantities import quantity
from gearchaos.studies.core.axis import Axis, check_plane
from gearchaos.studies.operation.load_change import REVERSAL, LoadChange

COLOURS = {
    "motion": "kind of motion",
    **{name: quantity(name).long_name for name in ("contact", "v_rms", "contact_fraction", "dynamic_factor")},
    "attractors": "number of attractors", "to_avoid": "to avoid, and reached by load changes",
    "share_of_load_changes": "share of load changes that separate",
}
"""Variables by which the map can be coloured, each with its description."""

OF_LOAD_CHANGES = ("to_avoid", "share_of_load_changes")
"""Those of them that only maps of gears have."""

OF_STARTS = ("attractors", *OF_LOAD_CHANGES)
"""Those of them that need several initial states in each cell."""

CHANGES: dict[str, tuple[str, float | None]] = {
    **{name: (LoadChange(ratio).words, ratio) for name, ratio in (("reversal", 1.0), ("loss", 0.0), ("half", -0.5))},
    "none": ("no load change", None), "wide": ("any state of wide ranges", None),
}
"""What is looked at beside operation: words, and λ of `LoadChange` where the load changes."""

LINES = {"x": "horizontal", "y": "vertical"}
"""Directions of the bifurcation diagram through the point, by the axis of the map."""


@dataclass(frozen=True)
class View:
    """The state of a page: everything that determines what it shows; `InputError` if a value is not accepted."""

    model: MeshModel  # all parameters except the two of the map; an `OperatingModel` or `TrainModel` of gears
    x: Axis  # the axes of the map, over the part in view
    y: Axis
    at: tuple[float, float]  # the point chosen, in the two parameters of the map
    colour: str = "motion"  # the variable by which the map is coloured, one of `COLOURS`
    line: str = "x"  # the axis along which the bifurcation diagram runs through the point, one of `LINES`
    initial: tuple[tuple[str, float], ...] = ()  # of another motion chosen at the point; empty for those of the model
    physical: bool = False  # whether results are shown in the units of the gears, if there are some
    mesh: str = ""  # of a train, the mesh whose contact and motion are shown; empty for the worst one
    run: Run | None = None  # the run-up that is played; None without gears
    vary: tuple[str, ...] = ()  # inputs of a pair with their scatter, of the study file; empty for those assumed
    change: str = "reversal"  # what gears are looked at for beside operation, one of `CHANGES`

    def __post_init__(self) -> None:
        check_known("colour", self.colour, COLOURS)
        check_known("line", self.line, LINES)
        check_known("change", self.change, CHANGES)
        if self.colour in OF_LOAD_CHANGES and gears_of(self.model) is None:
            raise InputError("colour", "needs gears", self.colour, "Choose the gears in the menu of presets.")
        check_known("mesh", self.mesh, ("", *self.model.mesh_names))
        if self.run is not None and gears_of(self.model) is None:
            raise InputError("run-up", "needs gears", str(self.run), "Choose the gears in the menu of presets.")
        _check_model(self.model)
        for axis, value, count in zip((self.x, self.y), self.at, models.map_cells(self.model), strict=True):
            for end in (axis.start, axis.stop, value):
                bounded(axis.name, end)
            if axis.count != count:
                raise InputError(f"axis {axis.name} count", f"must be {count} in the explorer", axis.count)
        if isinstance(self.model, OperatingModel):  # the torque at every row is a gear pair of its own
            check_plane(self.model, *(replace(axis, count=2) for axis in (self.x, self.y)))
            models.check_operating_range(self.model, (self.x, self.y))
            _check_model(self.point)
        else:
            check_plane(self.model, self.x, self.y)
        _ = self.point

    @cached_property
    def operating_point(self) -> MeshModel:
        """The model with the parameters of the point, and the initial values of `model`."""
        return self.model_at({})

    def model_at(self, values: Mapping[str, float]) -> MeshModel:
        """The model with the parameters of the point but for these."""
        at = dict(zip((self.x.name, self.y.name), self.at, strict=True))
        found = self.model.with_values({name: values.get(name, value) for name, value in at.items()})
        others = {name: value for name, value in values.items() if name not in at}
        found = found.with_values(others) if others else found
        return models.settled(found) if isinstance(found, OperatingModel) else found

    @property
    def gears(self) -> Gears | None:
        """The gears at the point; None for a dimensionless model."""
        return gears_of(self.operating_point)

    @cached_property
    def point(self) -> MeshModel:
        """The operating point, with the initial values of the motion chosen there."""
        return self.operating_point.with_values(dict(self.initial)) if self.initial else self.operating_point

    @cached_property
    def map_key(self) -> tuple[Any, ...]:
        """What the map depends on: two views have the same map if their keys are equal."""
        return *self.plane_key, self.load_change if self.colour in OF_STARTS else None

    @property
    def load_change(self) -> float:
        """λ of the load changes that the map looks at: those chosen, or reversals where none is, or no gears are."""
        ratio = CHANGES[self.change][1]
        return REVERSAL.ratio if ratio is None or gears_of(self.model) is None else ratio

    @cached_property
    def plane_key(self) -> tuple[Any, ...]:
        """The window of the map and all other parameters, on which the bifurcation curves over the map depend."""
        corner = self.model.with_values({self.x.name: self.x.start, self.y.name: self.y.start})
        return corner, self.x, self.y

    @property
    def line_axis(self) -> Axis:
        """The axis along which the bifurcation diagram runs."""
        return self.x if self.line == "x" else self.y

    @property
    def line_key(self) -> tuple[Any, ...]:
        """What the bifurcation diagram depends on: `branch_key`, and the units."""
        return *self.branch_key, self.physical and self.gears is not None

    @property
    def branch_key(self) -> tuple[Any, ...]:
        """The range of the line and all other parameters, on which the branch of an orbit along the line depends."""
        axis = self.line_axis
        return self.operating_point.with_values({axis.name: axis.start}), axis

    @property
    def sounds(self) -> bool:
        """Whether the run-up is to be heard."""
        return self.run is not None and self.run.sound

    @cached_property
    def run_key(self) -> tuple[Any, ...]:
        """What the run-up depends on but its sound, and where it is marked on the map."""
        run = self.run and replace(self.run, sound=False)
        at_first = self.operating_point.with_values({"speed": run.start}) if run else None
        return at_first, run, self.mesh, self.x.name, self.y.name

    def with_run(self, **values: Any) -> View:
        """The view with values of its run-up changed."""
        return self if self.run is None else replace(self, run=replace(self.run, **values))

    def with_axes(self, x: Axis, y: Axis) -> View:
        """The same model over another plane, or another part of this one; the parameters at the point stay the same."""
        model = self.operating_point
        return replace(self, model=model, x=x, y=y, at=(value_on(model, x), value_on(model, y)))

    def with_axis(self, which: str, name: str) -> View:
        """The view with another parameter along the axis ``which`` ("x" or "y"), over the range of its slider.

        If the other axis has that parameter, the axes are exchanged.
        """
        old, other = (self.x, self.y) if which == "x" else (self.y, self.x)
        if name == old.name:
            return self
        if name == other.name:
            x, y = (Axis(a.name, a.start, a.stop, b.count) for a, b in ((self.y, self.x), (self.x, self.y)))
            return self.with_axes(x, y)
        slider = models.slider_range(gears_of(self.model), name)
        new = Axis(name, slider.low, slider.high, old.count)
        return self.with_axes(new, self.y) if which == "x" else self.with_axes(self.x, new)

    def moved(self, x: float, y: float) -> View:
        """The view with another point, and the initial values of the model."""
        at = _accepted(self.model, self.x, x), _accepted(self.model, self.y, y)
        return replace(self, at=at, initial=())

    def stepped(self, columns: int, rows: int) -> View:
        """The view with the point moved by a number of cells of the map."""
        size = [(a.stop - a.start) / (a.count - 1) for a in (self.x, self.y)]
        return self.moved(self.at[0] + columns * size[0], self.at[1] + rows * size[1])

    def zoomed(self, x: tuple[float, float], y: tuple[float, float]) -> View:
        """The view of another part of the plane, between these ends (low, high) of both axes."""
        ends = zip((self.x, self.y), (x, y), strict=True)
        across, up = (Axis(a.name, float(low), float(high), a.count) for a, (low, high) in ends)
        return replace(self, x=across, y=up)

    def with_changed_initial(self, values: Mapping[str, float]) -> View:
        """The view with these initial values changed; those of a motion chosen before stay otherwise."""
        chosen = replace(self.operating_point, initial={}).with_values(dict(self.initial)).with_values(values)
        return replace(self, initial=tuple(chosen.initial.items()))

    def with_value(self, name: str, value: object) -> View:
        """The view with a parameter or initial value set; setting a parameter of the map moves the point."""
        accepted = bounded(name, value)
        if isinstance(self.model, OperatingModel) and name in models.GEAR_VALUES:
            at = list(self.at)  # moved by a value that an axis has, or that one stands for
            for i, axis in enumerate((self.x, self.y)):
                moved = accepted if axis.name == name else models.at_on_axis(self.model, axis.name, name, accepted)
                if moved is not None:
                    at[i] = moved
                    return replace(self, at=(at[0], at[1]), initial=())
            gears = models.with_gear_value(self.model.gears, name, accepted)
            return replace(self, model=models.with_new_gears(self.model, gears), initial=())
        for i, axis in enumerate((self.x, self.y)):
            own, of_axis = set(self.model.set_by(name)), set(self.model.set_by(axis.name))
            if name == axis.name:
                return replace(self, at=(accepted, self.at[1]) if i == 0 else (self.at[0], accepted), initial=())
            if own & of_axis:
                raise InputError(name, f"must be left to the axis {axis.name}", accepted, "Choose another axis first.")
        model = self.model.with_values({name: accepted})
        model = models.settled(model) if isinstance(model, OperatingModel) else model
        return replace(self, model=model, initial=())

    def with_alike_wheels(self) -> View:
        """The view with the values of wheel 1 for both wheels."""
        view = self
        for pair in WHEELS:
            if not equal(view.operating_point, pair):
                view = view.with_value(pair, view.operating_point.parameters()[PARAMETER_PAIRS[pair][0]])
        return view

    def with_other_units(self) -> View:
        """The view with physical instead of dimensionless units, or the other way round."""
        if self.gears is None:
            raise InputError("units", "must be dimensionless for a figure of the paper", "physical",
                             "Choose the gears in the menu of presets.")
        return replace(self, physical=not self.physical)

    def with_kind(self, kind: str) -> View:
        """The view with another kind of model; axes of parameters that it does not have are replaced by the default."""
        check_known("kind", kind, KINDS)
        check_is_pair(self.model, "another kind of model")
        point = self.operating_point
        if isinstance(point, OperatingModel):
            model: MeshModel = models.with_new_gears(point, point.gears, kind)
        else:
            model = as_kind(point, kind)
        return self._with_model(model)

    def with_stiffness(self, name: str) -> View:
        """The view with this kind of mesh stiffness, at its default values, unless it has it already."""
        STIFFNESS_KINDS.check("stiffness", name)
        check_is_pair(self.model, "another kind of stiffness")
        if name == self.model.stiffness.kind:
            return self
        return self._with_model(replace(self.operating_point, stiffness=STIFFNESS_KINDS[name].example()))

    def with_damping_law(self, name: str) -> View:
        """The view with this damping law of the mesh, also of its gears."""
        DAMPING_LAWS.check("damping_law", name)
        if name == self.model.damping_law:
            return self
        return self._with_model(self.operating_point.with_values({"damping_law": name}))

    def _with_model(self, model: MeshModel) -> View:
        """The view of another model; an axis whose parameter it does not have is replaced by that of figure 2."""
        names, first = axis_names(model), first_plane()
        x, y = (a if a.name in names else other for a, other in zip((self.x, self.y), first, strict=True))
        if x.name == y.name:
            x, y = first
        return replace(self, model=model, x=x, y=y, at=(value_on(model, x), value_on(model, y)), initial=())


def view_of(model: MeshModel, x: Axis | None = None, y: Axis | None = None, *, vary: tuple[str, ...] = ()) -> View:
    """The view of a model over these axes, whose counts are ignored, with the scatter of inputs of a study file.

    By default the axes are those of the paper's figure 2; for the model of gears their speed and torque, the map shows
    the contact of the teeth, and results are in their units.
    """
    gears = gears_of(model)
    defaults = first_plane() if gears is None else models.operating_axes(gears)
    x, y = (Axis(a.name, a.start, a.stop, n) if a else default
            for a, default, n in zip((x, y), defaults, models.map_cells(model), strict=True))
    run = None
    if gears is not None:  # over the axis of the speed, or else over the range of its slider
        slider = models.slider_range(gears, "speed")
        run = Run(*next(((a.start, a.stop) for a in (x, y) if a.name == "speed"), (slider.low, slider.high)))
    return View(model, x, y, (value_on(model, x), value_on(model, y)), "motion" if gears is None else "contact",
                physical=gears is not None, run=run, vary=vary)


def check_known(field: str, value: str, names: Iterable[str]) -> None:
    """Raise an `InputError` unless ``value`` is one of the names."""
    if value not in names:
        raise unknown_name(field, str(value)[:40], names)


def _check_model(model: MeshModel) -> None:
    """Raise an `InputError` unless every value is in the range that the explorer accepts.

    Gears may have harmonics of higher order than a visitor can set.
    """
    own = models.own_model(model.gears, model.kind).parameters() if isinstance(model, OperatingModel) else {}
    for name, value in {**model.parameters(), **model.initial}.items():
        if name == "omega" and isinstance(model, OperatingModel):
            models.check_omega(model, np.array(model.value("speed")), np.array(value))
        (in_range if own.get(name) == value else bounded)(name, value)
    if model.mesh_names:  # of a train, which have no levels over a mean
        return
    least, most = LEVELS
    for _, level in model.stiffness.parts(model.stiffness.numbers()) if model.stiffness.unnamed() else ():
        if not least <= level <= most:
            raise InputError("stiffness.levels", f"must lie in [{least:g}, {most:g}] in the explorer", level)


def _accepted(model: MeshModel, axis: Axis, value: float) -> float:
    """The nearest value that the explorer accepts, rounded to about what one pixel resolves."""
    least, most = models.limits(model, axis.name)
    return rounded(min(max(finite_number(axis.name, value), least), most), axis.stop - axis.start)
