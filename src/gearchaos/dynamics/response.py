"""Response measures of motions: velocities, loads and contact, from integrals and extrema along the motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from gearchaos.dynamics.columns import Column, Columns
from gearchaos.flow import Measure

CONTACTS = ("permanent", "one-sided", "two-sided", "none")
"""Contact states of a motion: never lost; lost, but the back flank not reached; both flanks reached; no contact."""


@dataclass
class Response(Columns):
    """Response measures of L motions, each (L,), dimensionless as in (2.10)-(2.12).

    Averages and extrema are over one period of an orbit, or `Classification.averaging_periods` for other motions.
    A new measure is declared here, computed in `compute_response`, and described in the table of quantities.
    """

    v_rms: Annotated[np.ndarray, Column(
        "root mean square of x1' (of z' in the single model), the paper's quality index", variable="v_rms")]
    contact_fraction: Annotated[np.ndarray, Column("share of the time with |z| > 1", variable="contact_fraction")]
    contact: Annotated[np.ndarray, Column(
        "index into `CONTACTS`", np.int8, missing=CONTACTS.index("none"), variable="contact")]
    dynamic_factor: Annotated[np.ndarray, Column(
        "peak of |mesh force| over the static mesh force; NaN without static load", variable="dynamic_factor")]
    z_rms: Annotated[np.ndarray, Column(
        "root mean square of z about its mean", variable="z_rms", stored=np.float32)]
    z_peak_to_peak: Annotated[np.ndarray, Column("range of z", variable="z_peak_to_peak", stored=np.float32)]
    z_dot_rms: Annotated[np.ndarray, Column("root mean square of z'", variable="z_dot_rms", stored=np.float32)]
    z_dot_peak_to_peak: Annotated[np.ndarray, Column(
        "range of z'", variable="z_dot_peak_to_peak", stored=np.float32)]
    switches_per_period: Annotated[np.ndarray, Column(
        "contact switches per mesh period", variable="switches", stored=np.float32)]
    mesh_force_peak: Annotated[np.ndarray, Column("peak of |mesh force|, with or without static load")]


def compute_response(
    measures: np.ndarray, duration: np.ndarray, periods: np.ndarray, static_force: np.ndarray
) -> Response:
    """Response measures of L motions.

    Parameters
    ----------
    measures : (len(Measure), L)
        Integrals and extrema over the duration, with rows as numbered by `flow.Measure`.
    duration : (L,)
        Duration in units of τ.
    periods : (L,)
        Duration in mesh periods.
    static_force : (L,)
        Mesh force of the static load.
    """
    m = measures
    offset = m[Measure.Z] / duration  # of the mean of z from the reference
    fraction = np.clip((m[Measure.FRONT_TIME] + m[Measure.BACK_TIME]) / duration, 0.0, 1.0)
    front, back, permanent = m[Measure.FRONT_TIME] > 0, m[Measure.BACK_TIME] > 0, fraction > 1 - 1e-12
    contact = np.select([front & back, permanent, front | back], [2, 0, 1], default=3).astype(np.int8)
    peak = np.maximum(np.abs(m[Measure.FORCE_MAX]), np.abs(m[Measure.FORCE_MIN]))
    static = np.where(static_force == 0, np.nan, np.abs(static_force))
    return Response(
        v_rms=np.sqrt(m[Measure.VELOCITY_SQUARE] / duration),
        contact_fraction=fraction,
        contact=contact,
        dynamic_factor=peak / static,
        z_rms=np.sqrt(np.maximum(m[Measure.Z_SQUARE] / duration - offset**2, 0.0)),
        z_peak_to_peak=m[Measure.Z_MAX] - m[Measure.Z_MIN],
        z_dot_rms=np.sqrt(m[Measure.Z_DOT_SQUARE] / duration),
        z_dot_peak_to_peak=m[Measure.Z_DOT_MAX] - m[Measure.Z_DOT_MIN],
        switches_per_period=m[Measure.SWITCHES] / periods,
        mesh_force_peak=peak,
    )
