"""Between which speeds others are computed, so that the edges of ranges to avoid and peaks beside them are located."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import groupby, pairwise

import numpy as np

from gearchaos.model import MeshModel
from gearchaos.studies.followed_motions import FollowedMotions, Motion

Severity = Callable[[Motion], int]
"""How strongly a speed is to be avoided for a motion: 0 for a motion that is no reason to."""

RESOLUTION = 0.005
"""Share of the speed to which edges and peaks are located."""

STEPS_PER_BANDWIDTH = 4
"""Least number of the first speeds in the half-power bandwidth of a resonance, 2ζ of its speed for each order."""

_MARGIN = 2.0
"""How many times as far as from its neighbour's a peak of the compression or force may rise between two speeds."""

MOST_SPEEDS = 4000
"""Most speeds that are computed."""


def first_step(model: MeshModel) -> float:
    """The largest step of the first speeds, over the speed."""
    return max(2 * (model.value("zeta") or 0.0) / STEPS_PER_BANDWIDTH, RESOLUTION)


def dense_speeds(motions: FollowedMotions, severity: Severity, model: MeshModel) -> list[float]:
    """As many equidistant speeds between two as resonances of the damping ask for, but none amid motions to be avoided
    that do not repeat.

    They have the same relative width at 1/n of the natural frequency for every n. Where ω < ζ a vibration is over
    within a mesh period, so that none of them stands out.
    """
    least = (model.value("zeta") or 0.0) * (model.value("speed") or 0.0) / (model.value("omega") or 1.0)
    out = []
    for low, high in pairwise(motions.speeds):
        if not all(any(severity(m) and not m.period for m in motions.at[end]) for end in (low, high)):
            parts = math.ceil((high - low) / (first_step(model) * max(low, least)))
            out += np.linspace(low, high, parts + 1)[1:-1].tolist()
    return out


def speeds_between(motions: FollowedMotions, severity: Severity, limit: float) -> list[float]:
    """Speeds in the middle between two that are further apart than the resolution, where one of these holds:

    - one is to be avoided, the other not, or for another reason;
    - both are to be avoided, but no such motion of one leads to such a motion of the other;
    - a motion of one is lost on the way to the other, and might come to separate if followed in smaller steps;
    - the teeth might separate at a peak between them, or the force exceed the limit;
    - the largest force of a range to be avoided is at one of them.
    """
    speeds = motions.speeds
    avoided = [worst(severity, motions.at[s]) for s in speeds]
    chosen = set()
    for i, (low, high) in enumerate(pairwise(speeds)):
        ways = [(m, m.leads_to[there], here) for here, there in ((low, high), (high, low)) for m in motions.at[here]]
        stays = any(severity(motion) and severity(reached) for motion, reached, _ in ways)
        returns = all(reached.leads_to[here] is motion for motion, reached, here in ways)
        if avoided[i] != avoided[i + 1] or not (stays if avoided[i] else returns):
            chosen.add(i)
    least = np.array([min((m.compression for m in motions.at[s] if not m.diverged), default=np.nan) for s in speeds])
    most = np.array([max((m.dynamic_factor for m in motions.at[s] if not m.diverged), default=np.nan) for s in speeds])
    free = np.array([not each for each in avoided])
    tips = _near_tips(-least, 0.0, free) | _near_tips(most, limit, free)
    for run in runs(avoided):
        if avoided[run[0]] and np.isfinite(most[run]).any():
            tips.add(run[int(np.nanargmax(most[run]))])
    chosen |= {j for i in tips for j in (i - 1, i) if 0 <= j < len(speeds) - 1}
    return [(speeds[i] + speeds[i + 1]) / 2 for i in sorted(chosen)
            if speeds[i + 1] - speeds[i] > RESOLUTION * speeds[i]]


def _near_tips(values: np.ndarray, limit: float, free: np.ndarray) -> set[int]:
    """Local peaks of values (N,) at ``free`` speeds, between whose neighbours the values might exceed a limit."""
    padded = np.concatenate([values[:1], values, values[-1:]])
    rise = values - np.fmin(padded[:-2], padded[2:])
    peak = (values >= padded[:-2]) & (values >= padded[2:]) & free
    return set(np.flatnonzero(peak & (values + _MARGIN * rise > limit)).tolist())


def worst(severity: Severity, motions: list[Motion]) -> int:
    """How strongly a speed with these motions is to be avoided."""
    return max(map(severity, motions))


def runs(values: Sequence[int]) -> list[list[int]]:
    """The indices of equal consecutive values."""
    return [[i for i, _ in run] for _, run in groupby(enumerate(values), key=lambda pair: pair[1])]
