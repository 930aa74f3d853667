"""The text on the motion at a point: the verdict and its evidence."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearchaos.datasets import variable
from gearchaos.explorer.jobs.orbits import obstacle
from gearchaos.explorer.jobs.point import PointMotion
from gearchaos.explorer.panels.style import Units, hint, motion_colour, symbol, unit
from gearchaos.explorer.view.models import gear_values
from gearchaos.explorer.view.state import View
from gearchaos.gears.operating import OperatingModel, pair_of
from gearchaos.gears.units import RPM
from gearchaos.quantities import quantity

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
HINTS = {words: hint(name) for name, words in {
    **_MEASURES, **_FORCES, "contact": quantity("contact").title, "multiplier": _MULTIPLIER,
    "lyapunov": quantity("lyapunov").long_name}.items()}
"""What the rows of a verdict mean, by their names."""


class VerdictText(NamedTuple):
    """What the page says of a motion beside its label and reason."""

    colour: str  # of the kind of motion
    where: str  # the point on the map
    rows: list[tuple[str, str]]  # names and values of the evidence and of the response measures
    spectral: str  # the class by the spectrum of the stroboscopic points alone, or "the same"; empty if there is none
    evidence: str  # what the verdict rests on
    obstacle: str  # why the branch of the motion cannot be followed; empty if it can


def verdict_text(found: PointMotion, view: View, units: Units) -> VerdictText:
    """What the page says of the motion at a point beside its label and reason, in these units."""
    v, model, number = found.verdict, found.verdict.model, units.number
    where = ", ".join(f"{symbol(axis.name)} = {at:g}{units.after(axis.name)}"
                      for axis, at in zip((view.x, view.y), view.at, strict=True))
    rows = []
    if units.gears is not None and isinstance(model, OperatingModel):
        values, pair = gear_values(model), pair_of(units.gears)
        frequency, force = values["speed"] * RPM * pair.n1 / (2 * np.pi), values["torque"] / pair.R1
        rows += [(name, number(f"{value:.5g}", unit_text)) for name, value, unit_text in (
            ("speed of wheel 1", values["speed"], "rpm"), ("mesh frequency", frequency, "Hz"),
            ("torque at wheel 1", values["torque"], "N m"), ("static mesh force", force, "N"))]
    if v.contact:
        rows.append((quantity("contact").title, f"{v.contact}: {_CONTACT[v.contact]}"))
    titles = _MEASURES | (_FORCES if units.gears is not None else {})
    known = {n: x for n in titles if (x := getattr(v, n)) is not None}
    measures = units.variables({n: variable(n, (), np.array(x)) for n, x in known.items()})
    rows += [(titles[n], number(f"{float(value):.5g}", unit(value))) for n, value in measures.items()]
    if v.multipliers:
        rows.append((_MULTIPLIER, number(f"{max(map(abs, v.multipliers)):.6f}", "")))
        rows.append((quantity("residual").title, number(f"{v.residual:.2g}", "")))
    elif v.lyapunov:
        exponent, low, high = (units.one("lyapunov") * x for x in (v.lyapunov[0], *v.lyapunov_ci[0]))
        mark = "1/s" if units.gears is not None else "ω₀" if units.marked else ""
        rows.append((quantity("lyapunov").long_name, number(f"{exponent:+.3g} ({low:+.3g} to {high:+.3g})", mark)))
    rows.append((quantity("periods_spent").title, number(f"{v.periods_spent:,}", "")))
    return VerdictText(
        motion_colour(v.label), where, rows,
        spectral="the same" if v.spectral_label == v.label else v.spectral_label or "",
        evidence="the orbit itself and its multipliers" if v.multipliers else "the Lyapunov exponents",
        obstacle=obstacle(found),
    )
