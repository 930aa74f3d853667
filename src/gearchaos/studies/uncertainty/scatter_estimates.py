"""Estimates from independent scramblings of a sequence, with 95 % intervals: probabilities, Sobol's indices, and what
the tightening of an input brings.

Arrays have the R scramblings first; an estimate is an array (3, ...): value, lower and upper end.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gearchaos.studies.core.proportions import CONFIDENCE, proportion
from gearchaos.studies.uncertainty.distributions import Scattered

_FEW = 16  # events, or events that are missing, below which an interval is that of a binomial distribution
_BINS = 8  # parts of equal probability in which the best value of an input is looked for


def jackknife(estimate: Callable[..., np.ndarray], *means: np.ndarray) -> np.ndarray:
    """An estimate (3, ...) that is a function of means, from their values in R scramblings, (R, ...) each.

    The pseudo-values of the jackknife are averaged, and their scatter gives the interval by Student's t with R − 1
    degrees of freedom. Where the function is linear, they are its values in the scramblings.
    """
    from scipy.stats import t

    count = len(means[0])
    whole = estimate(*(each.mean(axis=0) for each in means))
    left = np.stack([estimate(*((each.sum(axis=0) - each[r]) / (count - 1) for each in means)) for r in range(count)])
    pseudo = count * whole - (count - 1) * left
    half = t.ppf((1 + CONFIDENCE) / 2, count - 1) * pseudo.std(axis=0, ddof=1) / np.sqrt(count)
    return np.stack([pseudo.mean(axis=0), pseudo.mean(axis=0) - half, pseudo.mean(axis=0) + half])


def _ratio(above: np.ndarray, below: np.ndarray) -> np.ndarray:
    return np.divide(above, below, out=np.full(np.broadcast(above, below).shape, np.nan), where=below > 0)


def probability(events: np.ndarray, among: np.ndarray) -> np.ndarray:
    """The probability (3, ...) of events (R, n, ...) among the samples (R, n), or (R, n, ...), that count.

    Where events are few, or nearly all, the interval is that of Clopper and Pearson: the scramblings then differ too
    little to show what is not known. No interval is narrower than theirs without an event.
    """
    among = np.broadcast_to(among.reshape(*among.shape, *[1] * (events.ndim - among.ndim)), events.shape)
    number, total = (each.sum(axis=(0, 1)) for each in (events & among, among))
    found = _widened(jackknife(_ratio, (events & among).mean(axis=1), among.mean(axis=1)), total)
    few = np.minimum(number, total - number) < _FEW
    return np.where(few, proportion(number, total), found)


def _widened(found: np.ndarray, total: np.ndarray) -> np.ndarray:
    """A probability (3, ...) with an interval no narrower than that of no event among these numbers of samples."""
    least = 1 - ((1 - CONFIDENCE) / 2) ** (1 / np.maximum(total, 1))
    ends = np.minimum(found[1], found[0] - least), np.maximum(found[2], found[0] + least)
    return np.clip(np.stack([found[0], *ends]), 0.0, 1.0)


def sobol_indices(a: np.ndarray, b: np.ndarray, mixed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First-order and total indices (3, k) of an output at the points A and B, (R, n) each, and at A with one input
    from B, (k, R, n).

    The first order is that of Saltelli, the total one that of Jansen (Saltelli et al., Comput. Phys. Commun. 181 (2010)
    259, table 2, b and f), both within 0 and 1, as shares are. NaN for an output that does not vary.
    """
    centre = (a.mean() + b.mean()) / 2
    a, b, mixed = a - centre, b - centre, mixed - centre
    mean, square = ((a + b) / 2).mean(axis=1), ((a**2 + b**2) / 2).mean(axis=1)
    first = (b * (mixed - a)).mean(axis=2).T
    total = ((a - mixed) ** 2).mean(axis=2).T / 2

    def over_variance(part: np.ndarray, square: np.ndarray, mean: np.ndarray) -> np.ndarray:
        variance = square - mean**2
        return _ratio(part, np.broadcast_to(np.where(variance > 1e-14 * square, variance, 0.0), part.shape))

    one, all_of_it = (np.clip(jackknife(over_variance, each, square, mean), 0.0, 1.0) for each in (first, total))
    return one, all_of_it


def at_best(
    values: np.ndarray, among: np.ndarray, u: np.ndarray, scattered: Scattered
) -> tuple[np.ndarray, tuple[float, float]]:
    """The mean (3,) of values (R, n) where one input is held where it is best, and between which values that is.

    The input, at probabilities u (R, n), is held in the best of eight parts of equal probability and those beside it
    that are not surely worse, or at an item of a list. Half of the scramblings choose the parts, and the others tell
    the mean there: where they were chosen, they look better than they are.
    """
    bins = len(scattered.items) or _BINS
    inside = (np.minimum((u * bins).astype(int), bins - 1)[..., None] == np.arange(bins)) & among[..., None]
    above, below = (each.mean(axis=1) for each in (values[::2, :, None] * inside[::2], inside[::2]))
    means = _ratio(above.mean(axis=0), below.mean(axis=0))
    best = int(np.argmin(np.where(np.isfinite(means), means, np.inf)))
    alike = np.arange(bins) == best
    if not scattered.items:
        alike |= jackknife(lambda a, b: _ratio(a, b) - _ratio(a, b)[best], above, below)[1] <= 0
    first = best - int(np.argmin([*alike[best::-1], False])) + 1
    last = best + int(np.argmin([*alike[best:], False]))
    low, high = scattered.at(np.array([first + 1e-4, last - 1e-4]) / bins)
    return _mean(values[1::2], inside[1::2, :, first:last].any(axis=2)), (float(low), float(high))


def _mean(values: np.ndarray, among: np.ndarray) -> np.ndarray:
    """The mean (3,) of values (R, n) among samples; of events their probability."""
    if values.dtype == bool:
        return probability(values, among)
    return jackknife(_ratio, (values * among).mean(axis=1), among.mean(axis=1))


def at_half(values: np.ndarray, among: np.ndarray, u: np.ndarray, scattered: Scattered) -> np.ndarray:
    """The mean (3,) of values (R, n) where one input has half the spread about the same middle; NaN for a list."""
    weights = scattered.narrowed(u)
    if weights is None:
        return np.full(3, np.nan)
    if scattered.mean is None:
        return _mean(values, among & (weights > 0))
    weights = weights * among
    found = jackknife(_ratio, (values * weights).mean(axis=1), weights.mean(axis=1))
    return _widened(found, weights.sum() ** 2 / (weights**2).sum()) if values.dtype == bool else found
