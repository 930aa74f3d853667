"""What a motion means to an engineer: contact, loads and levels, from the flow's measures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearchaos.flow import Measure

CONTACTS = ("permanent", "one-sided", "two-sided", "none")
"""Contact states of a motion: never lost; lost, but the back flank not reached; both flanks; no contact at all."""


@dataclass(frozen=True)
class Response:
    """Levels of L motions, each (L,), dimensionless as in (2.10)-(2.12).

    Attributes
    ----------
    v_rms : root mean square of x1' (z' in the single model), the paper's quality index.
    contact_fraction : share of the time with |z| > 1.
    contact : index into `CONTACTS`.
    dynamic_factor : peak of |mesh force| over the static mesh force; NaN without static load.
    z_rms, z_peak_to_peak, z_dot_rms, z_dot_peak_to_peak : of z about its mean, and of z'.
    switches : contact switches per mesh period.
    mesh_force_peak : peak of |mesh force|, with or without static load.
    """

    v_rms: np.ndarray
    contact_fraction: np.ndarray
    contact: np.ndarray
    dynamic_factor: np.ndarray
    z_rms: np.ndarray
    z_peak_to_peak: np.ndarray
    z_dot_rms: np.ndarray
    z_dot_peak_to_peak: np.ndarray
    switches: np.ndarray
    mesh_force_peak: np.ndarray


def response(measures: np.ndarray, duration: np.ndarray, periods: np.ndarray, static_force: np.ndarray) -> Response:
    """Levels from measures (MEASURES, L) over a duration (L,) in τ, which is so many mesh periods (L,)."""
    m = measures
    mean = m[Measure.Z] / duration
    fraction = np.clip((m[Measure.FRONT_TIME] + m[Measure.BACK_TIME]) / duration, 0.0, 1.0)
    peak = np.maximum(np.abs(m[Measure.FORCE_MAX]), np.abs(m[Measure.FORCE_MIN]))
    static = np.where(static_force == 0, np.nan, np.abs(static_force))
    return Response(
        v_rms=np.sqrt(m[Measure.VELOCITY_SQUARE] / duration),
        contact_fraction=fraction,
        contact=_contact(m, fraction),
        dynamic_factor=peak / static,
        z_rms=np.sqrt(np.maximum(m[Measure.Z_SQUARE] / duration - mean**2, 0.0)),
        z_peak_to_peak=m[Measure.Z_MAX] - m[Measure.Z_MIN],
        z_dot_rms=np.sqrt(m[Measure.Z_DOT_SQUARE] / duration),
        z_dot_peak_to_peak=m[Measure.Z_DOT_MAX] - m[Measure.Z_DOT_MIN],
        switches=m[Measure.SWITCHES] / periods,
        mesh_force_peak=peak,
    )


def _contact(m: np.ndarray, fraction: np.ndarray) -> np.ndarray:
    """Whether contact lasts, and whether the far flank is reached; which flank carries the load does not matter."""
    front, back = m[Measure.FRONT_TIME] > 0, m[Measure.BACK_TIME] > 0
    kept = fraction > 1 - 1e-12
    return np.select([front & back, kept, front | back], [2, 0, 1], default=3).astype(np.int8)
