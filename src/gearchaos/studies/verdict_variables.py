"""Verdicts as named arrays: what every study reports of each of its cells."""

from __future__ import annotations

import numpy as np

from gearchaos.dynamics import Verdicts

LEVELS = (
    "v_rms", "contact_fraction", "contact", "dynamic_factor", "z_rms", "z_peak_to_peak", "z_dot_rms",
    "z_dot_peak_to_peak", "switches",
)


_SINGLE = (
    "trace_error", "residual", "rotation", "z_rms", "z_peak_to_peak", "z_dot_rms", "z_dot_peak_to_peak", "switches",
)
"""Kept in single precision: a map of ten million cells must fit a laptop."""


def verdict_variables(verdicts: Verdicts) -> dict[str, np.ndarray]:
    """Arrays (L,) by variable name."""
    out = {
        "label": verdicts.label, "period": verdicts.period, "reason": verdicts.reason,
        "lyapunov": verdicts.exponent[0], "lyapunov_lo": verdicts.low[0], "lyapunov_hi": verdicts.high[0],
        "trace_error": verdicts.trace_error, "residual": verdicts.residual,
        "multiplier": np.abs(verdicts.multipliers).max(axis=1),
        "rotation": verdicts.rotation, "transient_chaos": verdicts.transient_chaos.astype(np.int8),
        "periods_spent": verdicts.periods_run.astype(np.int32),
    }
    for name in LEVELS:
        values = getattr(verdicts.response, name)
        out[name] = np.nan_to_num(values, nan=3).astype(np.int8) if name == "contact" else values
    return {name: value.astype(np.float32) if name in _SINGLE else value for name, value in out.items()}


def blank(name: str, dtype: np.dtype) -> float | int:
    """What stands where a variable was not computed: NaN; -1 for contact; 0, which is no label, in whole numbers."""
    if dtype.kind == "f":
        return np.nan
    return -1 if name.startswith("contact") else 0
