"""The motion at the point: histories, phase trajectory, stroboscopic portrait, spectrum; its verdict in words."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from bokeh.models import ColumnDataSource, DataRange1d, FixedTicker, Line, LinearAxis, Range1d, Scatter, Span

from gearchaos.datasets import variable
from gearchaos.explorer.core import style, trains
from gearchaos.explorer.core.models import gear_values
from gearchaos.explorer.core.state import View
from gearchaos.explorer.core.style import BOUNDARY, FIRST_DATA, NONE, Panel, SetAttributes, Units
from gearchaos.explorer.features.motion.orbits import obstacle
from gearchaos.explorer.features.motion.point import PointMotion
from gearchaos.gears.io.units import RPM
from gearchaos.gears.operation.operating import OperatingModel, pair_of
from gearchaos.gears.train.model import TrainModel
from gearchaos.model import MeshModel
from gearchaos.plot.axes import mesh_period
from gearchaos.plot.motions import FLOOR, HISTORY_PERIODS, amplitudes
from gearchaos.plot.theme import INK, STROBE
from gearchaos.quantities import quantity
from gearchaos.studies.motion.regime import shared_loads
from gearchaos.studies.operation.factor_context import beside_factors, which_mesh

_HISTORY_SAMPLES = 8192  # largest number of samples drawn

_PERIODS = "time τ/T (mesh periods)"
_LARGE = 1e5  # N: forces are in kN where the largest is so large


def force_unit(largest: float) -> tuple[float, str]:
    """The unit in which forces are shown, in N and its name, by the largest in N."""
    return (1e3, "kN") if largest >= _LARGE else (1.0, "N")


class Wheels(NamedTuple):
    """What figures have to know of the wheels whose motion they draw, those of a pair or of one mesh of a train."""

    half_backlash: float = 1.0  # dimensionless
    cycles: int = 1  # mesh cycles in a period of the excitations
    turns: float = 0.0  # of wheel 1, or of the first body of a train, in that period
    static: float = 0.0  # mesh force of the mean torques, dimensionless


def wheels_of(view: View) -> Wheels:
    """The wheels whose motion a view draws."""
    model = view.point
    if isinstance(model, TrainModel):
        train, mesh = model.train, trains.shown_mesh(model, view.mesh)
        return Wheels(mesh.backlash / 2 / model.units.length, max([1, *train.cycles.values()]),
                      1 / float(train.base_order), trains.static_force(model, mesh))
    if view.gears is None:
        return Wheels()
    pair = pair_of(view.gears)
    return Wheels(turns=1 / pair.n1, static=pair.M10 / pair.R1 / pair.scales.force)


class _LineFigure(Panel):
    """A figure with one line, which is a single point until a motion is drawn."""

    def __init__(self, set_attributes: SetAttributes, title: str, width: float, **options: Any) -> None:
        super().__init__(set_attributes, title, **options)
        self.source = ColumnDataSource(FIRST_DATA)
        self.figure.add_glyph(self.source, Line(x="x", y="y", line_color=INK, line_width=width))

    def clear(self) -> None:
        """Draw nothing."""
        self._set(self.source, data=FIRST_DATA)


class HistoryFigure(_LineFigure):
    """The displacement z over the first mesh periods of the steady motion."""

    def __init__(self, set_attributes: SetAttributes) -> None:
        super().__init__(set_attributes, "Time history", 1.2, x_axis_label=_PERIODS)

    def show(self, motion: xr.Dataset, tau: np.ndarray, period: float, units: Units) -> None:
        """Draw a motion, which is in these units; its times ``tau`` (S,) and its mesh period are dimensionless."""
        time, shown, words = _times_shown(tau, period, units)
        self._set(self.source, data=_samples(time, motion["z"].values[shown]))
        self._label(words, units.label(motion["z"], "z"))


class ForceFigure(_LineFigure):
    """The mesh force over the first mesh periods of the steady motion, with the roll angle of wheel 1 above."""

    def __init__(self, set_attributes: SetAttributes) -> None:
        super().__init__(set_attributes, "Mesh force (dashed: static)", 1.2, ticks=6, x_axis_label=_PERIODS,
                         x_range=Range1d(0, 1), extra_x_ranges={"roll": Range1d(0, 1)})
        self.static = Span(dimension="width", location=0.0, line_color=BOUNDARY, line_dash="dashed")
        self.figure.add_layout(self.static)
        self.roll = LinearAxis(x_range_name="roll", axis_label="roll angle of wheel 1 [°]")
        style.style_axis(self.roll, ticks=6)
        self.figure.add_layout(self.roll, "above")

    def show(self, motion: xr.Dataset, tau: np.ndarray, period: float, units: Units, wheels: Wheels) -> None:
        """Draw a motion of gears; arguments as of `HistoryFigure.show`."""
        time, shown, words = _times_shown(tau, period, units)
        force = motion["mesh_force"].values[shown]
        unit, name = force_unit(np.abs(force).max())
        self._set(self.source, data=_samples(time, force / unit))
        self._set(self.static, location=wheels.static * units.one("mesh_force") / unit)
        self._set(self.figure.x_range, start=0.0, end=float(time[-1]))
        periods = float((tau[shown][-1] - tau[0]) / period)
        self._set(self.figure.extra_x_ranges["roll"], start=0.0, end=360 * periods * wheels.turns)
        self._label(words, units.label(motion["mesh_force"], "mesh_force").replace("[N]", f"[{name}]"))
        self._set(self.figure, visible=True)

    def clear(self) -> None:
        """Hide the figure: without a motion of gears its axes mean nothing."""
        self._set(self.figure, visible=False)


def _times_shown(tau: np.ndarray, period: float, units: Units) -> tuple[np.ndarray, np.ndarray, str]:
    """The times (N,) shown, from 0; which samples (S,) these are; and the label of their axis."""
    periods = (tau - tau[0]) / period
    shown = (periods <= HISTORY_PERIODS) & (np.arange(len(tau)) < _HISTORY_SAMPLES)
    if units.gears is None:
        return periods[shown], shown, _PERIODS
    return (tau[shown] - tau[0]) * units.one("tau"), shown, "time [ms]"


def _samples(x: np.ndarray, y: np.ndarray) -> dict[str, np.ndarray]:
    """The data of a line."""
    return {"x": x.astype(np.float32), "y": y.astype(np.float32)}


def times(motion: xr.Dataset) -> tuple[np.ndarray, float]:
    """The times (S,) of a dimensionless motion, and its mesh period."""
    return motion["tau"].values, mesh_period(motion)


_PHASE_SAMPLES = 8192  # largest number of samples of the trajectory drawn
_PHASE_POINTS = 96  # largest number of stroboscopic points drawn


class PhaseFigure(Panel):
    """Velocity against displacement, the ends of the backlash and the stroboscopic points."""

    def __init__(self, set_attributes: SetAttributes) -> None:
        super().__init__(set_attributes, "Phase (dashed: backlash)", x_range=DataRange1d(), y_range=DataRange1d())
        self.line, self.points = ColumnDataSource(FIRST_DATA), ColumnDataSource({"x": [], "y": []})
        self.ends = [Span(dimension="height", location=z, line_color=BOUNDARY, line_dash="dashed") for z in (-1, 1)]
        drawn = self.figure.add_glyph(self.line, Line(x="x", y="y", line_color=INK, line_width=1))
        dots = self.figure.add_glyph(self.points, Scatter(x="x", y="y", size=5, fill_color=STROBE, line_color=None))
        self.figure.x_range.renderers = self.figure.y_range.renderers = [drawn, dots]
        for end in self.ends:
            self.figure.add_layout(end)

    def show(self, motion: xr.Dataset, units: Units, wheels: Wheels) -> None:
        """Draw a motion, which is in these units."""
        self._set(self.line, data=_samples(*(motion[n].values[:_PHASE_SAMPLES] for n in ("z", "z_dot"))))
        x, y = (motion[f"section_{n}"].values[:_PHASE_POINTS] for n in ("z", "z_dot"))
        self._set(self.points, data={"x": x, "y": y})
        for sign, end in zip((-1, 1), self.ends, strict=True):
            self._set(end, location=sign * wheels.half_backlash * units.one("z"))
        self._label(units.label(motion["z"], "z"), units.label(motion["z_dot"], "z_dot"))

    def clear(self) -> None:
        """Draw nothing."""
        self._set(self.line, data=FIRST_DATA)
        self._set(self.points, data={"x": [], "y": []})


_FEW = 64  # up to this number of points, markers are large

_PADDING = 0.3
"""Room around the points, relative to the range of their values, so that few of them do not lie in the corners."""


class PortraitFigure(Panel):
    """Stroboscopic points in the plane of displacement and velocity."""

    def __init__(self, set_attributes: SetAttributes) -> None:
        super().__init__(set_attributes, "Stroboscopic portrait", x_range=DataRange1d(range_padding=_PADDING),
                         y_range=DataRange1d(range_padding=_PADDING))
        self.source = ColumnDataSource(FIRST_DATA)
        self.glyph = Scatter(x="x", y="y", size=0, fill_color=INK, line_color=None)
        self.figure.add_glyph(self.source, self.glyph)

    def show(self, found: PointMotion, units: Units) -> None:
        """Draw the points of a motion in these units; those of its portrait if there is one."""
        names = ("section_z", "section_z_dot")
        section = found.verdict.section if found.portrait is None else {
            n: found.portrait[f"section_{n}"].values for n in ("z", "z_dot")}
        points = {n: variable(n, ("period",), np.asarray(section[n.removeprefix("section_")])) for n in names}
        x, y = (units.variables(points)[n] for n in names)
        self._set(self.glyph, size=6 if len(x) <= _FEW else 2)
        self._set(self.source, data={"x": x.values, "y": y.values})
        self._label(units.label(x, "z"), units.label(y, "z_dot"))

    def clear(self) -> None:
        """Draw nothing."""
        self._set(self.glyph, size=0)
        self._set(self.source, data=FIRST_DATA)


_ORDERS = 6  # highest order of the mesh frequency shown

_ORDER, _AMPLITUDE = "order of the mesh frequency", "amplitude"


class SpectrumFigure(_LineFigure):
    """Amplitudes on a logarithmic scale; those of periodic motions are free of leakage."""

    def __init__(self, set_attributes: SetAttributes) -> None:
        super().__init__(set_attributes, "Spectrum of the velocity z′", 1.0, y_axis_type="log",
                         x_range=Range1d(0, _ORDERS), x_axis_label=_ORDER, y_axis_label=_AMPLITUDE)
        self.figure.xaxis.ticker = FixedTicker(ticks=list(range(_ORDERS + 1)))

    def show(self, motion: xr.Dataset, velocity: xr.DataArray, units: Units, wheels: Wheels) -> None:
        """Draw the spectrum of a velocity in these units; ``motion``, dimensionless, has the times of the samples."""
        cycles = wheels.cycles
        order, amplitude = amplitudes(motion.assign(z_dot=(velocity.dims, velocity.values)), "z_dot")
        inside = order <= _ORDERS * cycles
        self._set(self.figure.x_range, end=_ORDERS * cycles)
        self._set(self.figure.xaxis.ticker, ticks=[cycles * order for order in range(_ORDERS + 1)])
        least = max(float(amplitude[inside].max()) * FLOOR, 1e-37)
        self._set(self.source, data=_samples(order[inside], np.maximum(amplitude[inside], least)))
        _, bracket, unit = units.label(velocity, "z_dot").partition(" [")
        words = f"{_ORDER} [{NONE}]" if units.marked else _ORDER
        if units.gears is not None:  # with the frequency of order 1, short enough for a small figure
            words = f"order (1 is {1e3 / (mesh_period(motion) * units.one('tau')):.5g} Hz)"
        self._label(words, _AMPLITUDE + bracket + unit)


_MEASURES = {
    **{name: quantity(name).title for name in ("v_rms", "z_rms", "z_peak_to_peak", "contact_fraction")},
    "dynamic_factor": quantity("dynamic_factor").long_name,  # its title is too long for a narrow column
}
_JOINED = "\N{WORD JOINER}"  # keeps the characters beside it in one line
_FORCES = {"mesh_force_peak": quantity("mesh_force_peak").title}  # measures that are shown in the units of gears only

_CONTACT = {
    "permanent": "the teeth never part", "one-sided": "the teeth part, the back flank is not reached",
    "two-sided": "the teeth hit both flanks", "none": "no contact at all",
}

_MULTIPLIER = f"largest Floquet multiplier |{_JOINED}μ{_JOINED}|"
HINTS = {words: style.hint(name) for name, words in {
    **_MEASURES, **_FORCES, "contact": quantity("contact").title, "multiplier": _MULTIPLIER,
    "lyapunov": quantity("lyapunov").long_name}.items()}
"""What the rows of a verdict mean, by their names."""


MESH_NUMBERS = {"front_share": "{:.1%}", "back_share": "{:.1%}", "force_peak": "{:.4g}", "impacts_per_second": "{:.4g}",
                "dynamic_factor": "{:.4g}"}
"""Columns of the table of meshes: keys of `Verdict.meshes`, with the format of their numbers."""


class VerdictText(NamedTuple):
    """What the page says of a motion beside its label and reason."""

    colour: str  # of the kind of motion
    where: str  # the point on the map
    rows: list[tuple[str, str]]  # names and values of the evidence and of the response measures
    meshes: list[tuple[str, ...]]  # of a train, the numbers of `MESH_NUMBERS` of each mesh, after its name and contact
    loads: list[tuple[str, ...]]  # of a train, the rows of `shared_loads`
    force_unit: str  # of both
    drawn: str  # of a train, the mesh whose motion is drawn
    spectral: str  # the class by the spectrum of the stroboscopic points alone, or "the same"; empty if there is none
    evidence: str  # what the verdict rests on
    obstacle: str  # why the branch of the motion cannot be followed; empty if it can


@lru_cache(maxsize=64)
def _beside(model: MeshModel, factor: float | None) -> dict[str, str]:
    """What stands beside the dynamic factor of a motion, which is shown two or three times while it is computed."""
    return beside_factors(model, factor=factor)


def verdict_text(found: PointMotion, view: View, units: Units) -> VerdictText:
    """What the page says of the motion at a point beside its label and reason, in these units."""
    v, model, number = found.verdict, found.verdict.model, units.number
    where = ", ".join(f"{style.symbol(axis.name)} = {at:g}{units.after(axis.name)}"
                      for axis, at in zip((view.x, view.y), view.at, strict=True))
    rows = []
    if units.gears is not None and isinstance(model, OperatingModel):
        values, pair = gear_values(model), pair_of(units.gears)
        frequency, force = values["speed"] * RPM * pair.n1 / (2 * np.pi), values["torque"] / pair.R1
        rows += [(name, number(f"{value:.5g}", unit_text)) for name, value, unit_text in (
            ("speed of wheel 1", values["speed"], "rpm"), ("mesh frequency", frequency, "Hz"),
            ("torque at wheel 1", values["torque"], "N m"), ("static mesh force", force, "N"))]
    of = which_mesh() if v.meshes else {}
    drawn = trains.shown_mesh(model, view.mesh).name if isinstance(model, TrainModel) else ""
    if isinstance(model, TrainModel):
        train = model.train
        rows += [(f"speed of {train.bodies[0].name}", f"{train.speed:.5g} rpm"),
                 ("common period", f"{train.period * 1e3:.4g} ms")]
    elif v.contact:
        rows.append((quantity("contact").title, f"{v.contact}: {_CONTACT[v.contact]}"))
    titles = _MEASURES | (_FORCES if units.gears is not None else {})
    other = bool(drawn) and drawn != next(iter(v.meshes), drawn)  # what is of the first is none of it
    known = {n: x for n in titles if of.get(n) not in {"worst", *("first",) * other} and (
        x := getattr(v, n)) is not None}
    measures = units.variables({n: variable(n, (), np.array(x)) for n, x in known.items()})
    beside = {n: f", {next(iter(v.meshes))}" for n in known if of.get(n) == "first"}
    rows += [(titles[n] + beside.get(n, ""), number(f"{float(value):.5g}", style.unit(value)))
             for n, value in measures.items()]
    if "dynamic_factor" in known or v.meshes:
        rows += _beside(model, known.get("dynamic_factor")).items()
    if v.multipliers:
        rows.append((_MULTIPLIER, number(f"{max(map(abs, v.multipliers)):.6f}", "")))
        rows.append((quantity("residual").title, number(f"{v.residual:.2g}", "")))
    elif v.lyapunov:
        exponent, low, high = (units.one("lyapunov") * x for x in (v.lyapunov[0], *v.lyapunov_ci[0]))
        mark = "1/s" if units.gears is not None else "ω₀" if units.marked else ""
        rows.append((quantity("lyapunov").long_name, number(f"{exponent:+.3g} ({low:+.3g} to {high:+.3g})", mark)))
    rows.append((quantity("periods_spent").title, number(f"{v.periods_spent:,}", "")))
    unit, unit_name = force_unit(max((each["force_peak"] or 0.0 for each in v.meshes.values()), default=0.0))
    meshes = [(name, each["contact"], *(
        "–" if each[n] is None else shape.format(each[n] / (unit if n == "force_peak" else 1.0))
        for n, shape in MESH_NUMBERS.items())) for name, each in v.meshes.items()]
    return VerdictText(style.motion_colour(v.label), where, rows, meshes, shared_loads(v, unit),
                       unit_name, drawn,
                       spectral="the same" if v.spectral_label == v.label else v.spectral_label or "",
                       evidence="the orbit itself and its multipliers" if v.multipliers else "the Lyapunov exponents",
                       obstacle=obstacle(found))
