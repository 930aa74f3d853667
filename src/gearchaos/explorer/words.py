"""The dossier in words: the verdict, its evidence, the levels, the other motions of the point; as HTML."""

from __future__ import annotations

import html
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from gearchaos.datasets import variable
from gearchaos.explorer.dossier import Dossier
from gearchaos.explorer.units import in_units, unit_words
from gearchaos.gears.pair import GearPair
from gearchaos.plot._basins import attractor_colours, attractor_names
from gearchaos.plot._classes import MOTION_CLASSES
from gearchaos.studies.regime import Regime

_LEVELS = (
    ("v_rms", "rms velocity V_RMS"), ("z_rms", "rms of z"), ("z_peak_to_peak", "peak to peak of z"),
    ("contact_fraction", "share of the time in contact"), ("dynamic_factor", "dynamic factor"),
)
_CONTACT = {
    "permanent": "the teeth never part", "one-sided": "the teeth part, the back flank is not reached",
    "two-sided": "the teeth hit both flanks", "none": "no contact at all",
}


def colour(label: str) -> str:
    """The colour of a motion's class, by its label."""
    names = {c.name: c.colour for c in MOTION_CLASSES}
    return names.get(label, names["other sub-harmonic"])


def verdict_html(found: Dossier, where: str, stage: str, pair: GearPair | None) -> str:
    """The verdict with its evidence; ``stage`` says in the document how far the dossier is."""
    v = found.verdict
    soon = "" if found.final else (
        f'<p class="soon">so far: this may be a transient, so it is followed on (now {v.periods_spent:,} periods)</p>')
    rows = "".join(
        f"<tr><th>{html.escape(title)}</th><td>{html.escape(text)}</td></tr>" for title, text in _rows(v, pair))
    return (
        f'<div class="verdict" data-label="{v.label}" data-stage="{stage}" data-final="{int(found.final)}">'
        f'<div class="label" style="border-color:{colour(v.label)}"><b>{html.escape(v.label)}</b>'
        f"<span>{html.escape(where)}</span></div>"
        f"<p>{html.escape(v.reason)}</p>{soon}<table>{rows}</table>{_opinion(v)}</div>"
    )


def _rows(v: Regime, pair: GearPair | None) -> list[tuple[str, str]]:
    rows = []
    if v.contact:
        rows.append(("contact", f"{v.contact}: {_CONTACT[v.contact]}"))
    rows += _levels(v, pair)
    if v.multipliers:
        largest = max(map(abs, v.multipliers))
        rows.append(("largest Floquet multiplier |μ|", f"{largest:.6f}"))
        rows.append(("residual of the orbit", f"{v.residual:.1e}"))
    elif v.lyapunov:
        low, high = v.lyapunov_ci[0]
        rows.append(("largest Lyapunov exponent", f"{v.lyapunov[0]:+.3g} ({low:+.3g} to {high:+.3g})"))
    rows.append(("mesh periods computed", f"{v.periods_spent:,}"))
    return rows


def _opinion(v: Regime) -> str:
    """What the spectrum alone would say, and why it decides nothing."""
    if not v.spectral_label:
        return ""
    ground = "the orbit itself and its multipliers" if v.multipliers else "the Lyapunov exponents"
    says = "say the same" if v.spectral_label == v.label else f"would say {v.spectral_label}"
    return (
        f'<p class="opinion">Second opinion: the lines of the spectrum of 512 stroboscopic points, looked at alone, '
        f"{html.escape(says)}. That is cruder; the verdict rests on {ground}.</p>")


def _levels(v: Regime, pair: GearPair | None) -> list[tuple[str, str]]:
    """The levels that exist, in the units of the pair if there is one."""
    known = {n: x for n, _ in _LEVELS if (x := getattr(v, n)) is not None}
    levels = in_units({n: variable(n, (), np.array(x)) for n, x in known.items()}, pair)
    words = {n: f"{float(level):.5g}\N{NO-BREAK SPACE}{unit_words(level)}".strip() for n, level in levels.items()}
    return [(title, words[n]) for n, title in _LEVELS if n in known]


def attractor_choices(found: xr.Dataset) -> list[dict[str, Any]]:
    """Every motion of a point: its name, colour, share of the starts and a start that leads to it."""
    starts = [n for n in map(str, found.data_vars) if n.startswith("attractor_start_")]
    rows = zip(attractor_names(found), attractor_colours(found), strict=True)
    return [
        {
            "name": name, "colour": shade, "share": float(found["attractor_fraction"][i]),
            "v_rms": float(found["attractor_v_rms"][i]),
            "start": tuple((n.removeprefix("attractor_start_"), float(found[n][i])) for n in starts),
        } for i, (name, shade) in enumerate(rows)
    ]


def choices_html(choices: list[dict[str, Any]]) -> str:
    """A button for every motion of a point; the page's script says which one was pressed."""
    buttons = "".join(
        f'<button class="choice" data-choice="{i}" style="border-left-color:{html.escape(c["colour"])}">'
        f'{html.escape(c["name"])}  {100 * c["share"]:.0f} %</button>' for i, c in enumerate(choices)
    )
    return f'<div class="words">{"all motions here:" if choices else "looking for other motions here …"}{buttons}</div>'


def error_html(message: str) -> str:
    """A message about what cannot be done."""
    return f'<div class="error" role="alert">{html.escape(message)}</div>' if message else ""


def busy_html(panels: Sequence[str], compiling: bool) -> str:
    """What is being computed, and whether kernels are compiled for it first."""
    if not panels:
        return '<div class="busy idle"><i></i>ready</div>'
    first = "compiling kernels, once after an install or an update; then " if compiling else "computing "
    return f'<div class="busy"><i></i>{first}{html.escape(", ".join(panels))}</div>'
