"""The text on the motion at a point: the verdict and its evidence."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearchaos.datasets import variable
from gearchaos.explorer.jobs.point_motion import PointMotion
from gearchaos.explorer.panels.labels import in_units, symbol, unit
from gearchaos.explorer.panels.style import motion_colour
from gearchaos.explorer.view.state import View
from gearchaos.gears.pair import GearPair
from gearchaos.quantities import quantity
from gearchaos.studies.verdict import Verdict

_MEASURES = {
    **{name: quantity(name).title for name in ("v_rms", "z_rms", "z_peak_to_peak", "contact_fraction")},
    "dynamic_factor": quantity("dynamic_factor").long_name,  # its title is too long for a narrow column
}
_CONTACT = {
    "permanent": "the teeth never part", "one-sided": "the teeth part, the back flank is not reached",
    "two-sided": "the teeth hit both flanks", "none": "no contact at all",
}


@dataclass(frozen=True)
class VerdictText:
    """The text on the motion at a point.

    Attributes
    ----------
    label, reason, colour : str
        The kind of motion, why it is that one, and its colour.
    where : str
        The point on the map.
    stage : str
        As of `PointMotion.stage`.
    final : bool
        Whether the verdict is final.
    periods : str
        Mesh periods computed.
    rows : list of (str, str)
        Names and values of the evidence and of the response measures.
    spectral : str
        The class by the spectrum of the stroboscopic points alone, or "the same"; empty if there is none.
    evidence : str
        What the verdict rests on.
    """

    label: str
    reason: str
    colour: str
    where: str
    stage: str
    final: bool
    periods: str
    rows: list[tuple[str, str]]
    spectral: str
    evidence: str


def verdict_text(found: PointMotion, view: View, pair: GearPair | None) -> VerdictText:
    """The text on the motion at a point, with response measures in the units of the pair if there is one."""
    v = found.verdict
    where = ", ".join(f"{symbol(a.name)} = {value:g}" for a, value in zip((view.x, view.y), view.at, strict=True))
    spectral = "the same" if v.spectral_label == v.label else v.spectral_label or ""
    return VerdictText(
        label=v.label, reason=v.reason, colour=motion_colour(v.label), where=where, stage=found.stage,
        final=found.final, periods=f"{v.periods_spent:,}", rows=_rows(v, pair),
        spectral=spectral,
        evidence="the orbit itself and its multipliers" if v.multipliers else "the Lyapunov exponents",
    )


def _rows(v: Verdict, pair: GearPair | None) -> list[tuple[str, str]]:
    """Evidence and response measures, each with its name."""
    rows = []
    if v.contact:
        rows.append((quantity("contact").title, f"{v.contact}: {_CONTACT[v.contact]}"))
    rows += _measures(v, pair)
    if v.multipliers:
        largest = max(map(abs, v.multipliers))
        rows.append(("largest Floquet multiplier |μ|", f"{largest:.6f}"))
        rows.append((quantity("residual").title, f"{v.residual:.1e}"))
    elif v.lyapunov:
        low, high = v.lyapunov_ci[0]
        rows.append((quantity("lyapunov").long_name, f"{v.lyapunov[0]:+.3g} ({low:+.3g} to {high:+.3g})"))
    rows.append((quantity("periods_spent").title, f"{v.periods_spent:,}"))
    return rows


def _measures(v: Verdict, pair: GearPair | None) -> list[tuple[str, str]]:
    """Names of the response measures that this motion has, and their values with units."""
    known = {n: x for n in _MEASURES if (x := getattr(v, n)) is not None}
    measures = in_units({n: variable(n, (), np.array(x)) for n, x in known.items()}, pair)
    texts = {n: f"{float(value):.5g}\N{NO-BREAK SPACE}{unit(value)}".strip() for n, value in measures.items()}
    return [(title, texts[n]) for n, title in _MEASURES.items() if n in known]
