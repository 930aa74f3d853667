"""After how many mesh periods does a motion come back? A first guess, for `orbit` to prove or refute."""

from __future__ import annotations

import numpy as np

from gearchaos.flow import near_returns

_NEAR = 1e-3
"""Distance, over the size of the motion, at which a return is worth a closer look."""

_BEFORE = 0.01


def candidates(sections: np.ndarray, longest: int, count: int) -> np.ndarray:
    """The ``count`` shortest periods (count, L) at which each motion nearly returns; 0 where there is none.

    Parameters
    ----------
    sections : (S, d, L)
        Stroboscopic sections, newest last.

    The return before must have been a near one too: a chaotic motion passes close to where it was now and then, but
    seldom twice running. So the record must hold two rounds of a period.
    """
    return near_returns(sections, min(longest, (len(sections) - 1) // 2), _NEAR, _BEFORE, count)
