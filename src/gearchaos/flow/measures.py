"""The measures of motions: how they begin, and how those of parts are combined to those of whole motions."""

from __future__ import annotations

import numpy as np

from gearchaos.flow.kernels.constants import Measure

_FIRST: dict[np.ufunc, float] = {np.add: 0.0, np.maximum: -np.inf, np.minimum: np.inf}
"""The value with which each way of combining begins."""


def empty_measures(w: np.ndarray) -> np.ndarray:
    """The measures (len(Measure), L) of motions that are in the states w (d, L), before their first step."""
    out = np.empty((len(Measure), w.shape[1]))
    for measure in Measure:
        out[measure] = _FIRST[measure.combined]
    out[Measure.Z_REFERENCE] = w[0]
    return out


def combine_measures(measures: np.ndarray, duration: np.ndarray, first: np.ndarray) -> np.ndarray:
    """The measures of motions from those of their parts.

    The integrals of z are shifted to the reference of the first part, as in the parallel computation of a variance
    (T. F. Chan, G. H. Golub, R. J. LeVeque, *Algorithms for computing the sample variance*, Am. Stat. 37 (1983) 242).

    Parameters
    ----------
    measures : (len(Measure), P)
        Measures of the P parts, those of a motion one after the other.
    duration : (P,)
        Duration of each part in units of τ.
    first : (N,)
        Index of the first part of each of N motions.

    Returns
    -------
    (len(Measure), N)

    Examples
    --------
    >>> import gearchaos as gc
    >>> from gearchaos.studies.initial_value_problems import initial_value_problems
    >>> from gearchaos.flow import Measure, combine_measures
    >>> problem = initial_value_problems(gc.MeshModel.of(q0=0.1, eps1=0.1))
    >>> flow = problem.flow
    >>> first = flow.advance(problem.w, periods=4, measured=True)
    >>> second = flow.advance(first.w, periods=6, measured=True)
    >>> parts = np.hstack([first.measures, second.measures])
    >>> both = combine_measures(parts, np.array([4, 6]) * flow.system.period, np.array([0]))
    >>> both[Measure.SWITCHES].tolist()
    [18.0]
    """
    reference = measures[Measure.Z_REFERENCE]
    common = np.repeat(reference[first], np.diff(first, append=len(reference)))
    shift, about = reference - common, measures.copy()
    about[Measure.Z] += shift * duration
    about[Measure.Z_SQUARE] += shift * (2 * measures[Measure.Z] + shift * duration)
    about[Measure.Z_REFERENCE] = common
    return np.stack([measure.combined.reduceat(about[measure], first) for measure in Measure])
