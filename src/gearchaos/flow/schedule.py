"""Motions whose parameters change from one period to the next: a trajectory visits a list of parameter points."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearchaos.flow.exact import ExactFlow
from gearchaos.flow.kernels.vector.constants import OK


class Followed(NamedTuple):
    """Results for L motions along N periods; after the first status other than `OK` a motion is NaN.

    Attributes
    ----------
    w : (d, L)
        Coordinates at the end.
    measures : (N, K len(Measure), L)
        Of each period, in the rows of `Measure`.
    samples : (N, samples, d + 1, L)
        Coordinates and contact state.
    status : (L,)
        As of `FlowResult`.

    Examples
    --------
    >>> Followed._fields
    ('w', 'measures', 'samples', 'status')
    """

    w: np.ndarray
    measures: np.ndarray
    samples: np.ndarray
    status: np.ndarray


def follow_schedule(
    flow: ExactFlow, w: np.ndarray, points: np.ndarray, kicks: np.ndarray, factors: np.ndarray | float = 1.0,
) -> Followed:
    """Advance motions by one period at each of a list of points.

    Parameters
    ----------
    flow : ExactFlow
        With samples or without.
    w : (d, L)
        Coordinates at the start of the first period.
    points : (N, L)
        The point of each motion in each period.
    kicks : (N, d, L)
        What is added to the coordinates before each period: what they change by where the parameters do, while the
        positions and velocities of the wheels stay.
    factors : (N, d, L), optional
        What the coordinates are multiplied by before that: the ratio of the units before and after.

    Returns
    -------
    Followed

    Raises
    ------
    StoppedError
        If the computation is cancelled.

    Examples
    --------
    >>> import gearchaos as gc
    >>> import numpy as np
    >>> from gearchaos.studies.core.initial_value_problems import initial_value_problems
    >>> problem = initial_value_problems(gc.MeshModel.of(q0=0.1, eps1=0.1), {"omega": np.array([0.8, 0.9])}, samples=8)
    >>> visits = np.array([[0], [1], [0]])
    >>> found = follow_schedule(problem.flow, problem.w[:, :1], visits, np.zeros((3, 2, 1)))
    >>> found.samples.shape
    (3, 8, 3, 1)
    """
    w, found, status = np.array(w, float), [], np.full(w.shape[1], OK)
    for each, kick, factor in zip(points, kicks, np.broadcast_to(factors, kicks.shape), strict=True):
        out = flow.advance(np.where(status == OK, factor * w + kick, 0.0), 1, points=each, measured=True, sample=True)
        status = np.where(status == OK, out.status, status)
        w, unknown = out.w, np.where(status == OK, 0.0, np.nan)
        found.append((out.measures + unknown, out.samples[0] + unknown))
    measures, samples = (np.stack(part) for part in zip(*found, strict=True))
    return Followed(np.where(status == OK, w, np.nan), measures, samples, status)
