"""The verdict at one operating point, with all its evidence."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass

import numpy as np

from gearchaos.dynamics import REASONS, Classification, Label, Reason, Verdicts, classify, motion_name
from gearchaos.dynamics.response import CONTACTS
from gearchaos.dynamics.settings import as_settings
from gearchaos.dynamics.spectrum import spectral_class
from gearchaos.flow import ExactFlow
from gearchaos.gears.pair import GearPair, as_model
from gearchaos.model import MeshModel, vary
from gearchaos.model.coordinates import start
from gearchaos.model.switched import switched
from gearchaos.studies.cost import estimate
from gearchaos.studies.sections import steady_sections

PATIENT = Classification(exponent_run=2000, doublings=2, longest_transient=20_000, averaging_periods=1000)
"""One point is worth a longer look than a cell of a map: chaotic transients of twenty thousand periods pass."""

_SHOWN = 512


@dataclass(frozen=True)
class Regime:
    """What the mesh does at one operating point; see `regime`."""

    label: str
    period: int | None
    reason: str
    multipliers: list[list[float]]
    lyapunov: list[float]
    lyapunov_ci: list[list[float]]
    v_rms: float | None
    contact_fraction: float | None
    contact: str | None
    dynamic_factor: float | None
    section: dict[str, list[float]]
    residual: float | None
    trace_error: float | None
    periods_spent: int
    switches_per_period: float | None
    z_rms: float | None
    z_peak_to_peak: float | None
    z_dot_rms: float | None
    z_dot_peak_to_peak: float | None
    spectral_label: str | None
    mesh_force_peak: float | None

    def to_dict(self) -> dict:
        """The fields as plain JSON-ready values, None where a number does not exist."""
        return asdict(self)


def regime(model: MeshModel | GearPair, *, settings: Classification = PATIENT, progress: bool = False) -> Regime:
    """What will this gear mesh do?

    Parameters
    ----------
    model : MeshModel or GearPair
        The operating point, with its initial values.
    settings : Classification
        How long to wait and how hard to look.
    progress : bool
        Say on stderr how long it may take, if that is long.

    Returns
    -------
    Regime
        ``label`` is "1T", "2T", ..., "quasi-periodic", "chaotic", "undecided" or "diverged", with the ``reason``;
        ``multipliers`` as [re, im] of the polished orbit; ``lyapunov`` all exponents of the dynamic state with 99 %
        intervals, exact for an orbit; the levels; and the stroboscopic ``section``: the n points of a periodic motion,
        512 of any other.
    """
    model, settings = as_model(model), as_settings(settings) or PATIENT
    batch = vary(model, {})
    system = switched(batch)
    estimate(system, 1, settings.most).announce(progress)
    flow = ExactFlow(system)
    begin, point = start(batch, system).T.copy(), np.zeros(1, dtype=int)
    found = classify(flow, begin, settings=settings)
    label = Label(int(found.label[0]))
    sections = {} if label == Label.DIVERGED else steady_sections(batch, flow, point, begin, found, _SHOWN)
    shown = int(found.period[0]) or _SHOWN
    return Regime(
        label=motion_name(label, int(found.period[0])), period=int(found.period[0]) or None,
        reason=REASONS[Reason(int(found.reason[0]))], **_dynamics(found), **_levels(found, label),
        section={k: v[0, -shown:].tolist() for k, v in sections.items()},
        spectral_label=spectral_class(np.stack([sections["z"][0], sections["z_dot"][0]],
                                               axis=1))[0] if sections else None,
    )


def _dynamics(found: Verdicts) -> dict:
    has_orbit = found.period[0] > 0
    known = np.isfinite(found.exponent[:, 0])
    pairs = np.stack([found.low[:, 0], found.high[:, 0]], axis=1)
    return {
        "multipliers": [[m.real, m.imag] for m in found.multipliers[0].tolist()] if has_orbit else [],
        "lyapunov": found.exponent[known, 0].tolist(),
        "lyapunov_ci": pairs[known].tolist(),
        "residual": float(found.residual[0]) if has_orbit else None,
        "trace_error": _number(found.trace_error[0]),
        "periods_spent": int(found.periods_run[0]),
    }


def _levels(found: Verdicts, label: Label) -> dict:
    r = found.response
    values = {n: _number(getattr(r, n)[0]) for n in (
        "v_rms", "contact_fraction", "dynamic_factor", "z_rms", "z_peak_to_peak", "z_dot_rms", "z_dot_peak_to_peak",
        "mesh_force_peak",
    )}
    contact = None if label == Label.DIVERGED else CONTACTS[int(r.contact[0])]
    return {**values, "contact": contact, "switches_per_period": _number(r.switches[0])}


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
