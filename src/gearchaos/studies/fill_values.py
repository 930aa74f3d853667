"""Fill values: the values of result variables in cells that are not computed."""

from __future__ import annotations

import numpy as np


def fill_value(name: str, dtype: np.dtype) -> float | int:
    """The value of a variable where it is not computed: NaN for floats, −1 for contact states and ``proved``, else 0.

    0 is not a label, a period or a reason, but is a contact state, and means "not proved".
    """
    if dtype.kind == "f":
        return np.nan
    return -1 if name.startswith("contact") or name == "proved" else 0
