"""The values of result variables where they are not computed; `Verdicts.variables` gives those that are."""

from __future__ import annotations

import numpy as np


def blank(name: str, dtype: np.dtype) -> float | int:
    """The value of a variable where it is not computed.

    NaN; −1 for contact states, whose codes start at 0; and 0, which is no label, for other integers.
    """
    if dtype.kind == "f":
        return np.nan
    return -1 if name.startswith("contact") else 0
