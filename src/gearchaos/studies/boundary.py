"""How tangled the boundaries of basins are, and how small a kick crosses them."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import distance_transform_edt

_BOX = 5
_SHIFTS = (1, 2, 4, 8, 16)


def entropy(index: np.ndarray) -> tuple[float, float]:
    """Basin entropy and boundary basin entropy of a plane of attractor numbers (ny, nx), in nats.

    The mean over boxes of 5 × 5 cells of −Σ p ln p, p the shares of the attractors in a box; the second over the
    boxes with more than one attractor only, NaN if there is none. Above ln 2 the boundary is fractal. A. Daza, A.
    Wagemakers, B. Georgeot, D. Guéry-Odelin, M. A. F. Sanjuán, *Basin entropy*, Sci. Rep. 6 (2016) 31416.
    """
    ny, nx = (n // _BOX * _BOX for n in index.shape)
    boxes = index[:ny, :nx].reshape(ny // _BOX, _BOX, nx // _BOX, _BOX).swapaxes(1, 2).reshape(-1, _BOX**2)
    shares = np.stack([(boxes == k).mean(axis=1) for k in np.unique(index)], axis=1)
    each = -np.sum(shares * np.log(np.where(shares > 0, shares, 1.0)), axis=1)
    mixed = shares.max(axis=1, initial=0.0) < 1
    return _mean(each), _mean(each[mixed])


def _mean(values: np.ndarray) -> float:
    return float(values.mean()) if len(values) else float("nan")


def uncertainty_exponent(index: np.ndarray) -> float:
    """The exponent α of f(ε) ~ ε^α, f the share of cells (ny, nx) with another attractor at distance ε.

    1 for a smooth boundary, less for a fractal one, whose dimension is 2 − α; NaN without a boundary or with a plane
    of less than 64 cells a side. C. Grebogi, S. W. McDonald, E. Ott, J. A. Yorke, *Final state sensitivity*, Phys.
    Lett. A 99 (1983) 415.
    """
    if min(index.shape) < 4 * _SHIFTS[-1]:
        return float("nan")
    share = [0.5 * ((index[:, k:] != index[:, :-k]).mean() + (index[k:] != index[:-k]).mean()) for k in _SHIFTS]
    if share[0] == 0:
        return float("nan")
    return float(np.polyfit(np.log(_SHIFTS), np.log(share), 1)[0])


def smallest_kicks(index: np.ndarray, x: np.ndarray, y: np.ndarray, sections: list[np.ndarray]) -> np.ndarray:
    """The shortest way in the plane from a section point of each attractor to a start of another basin, (attractors,).

    Parameters
    ----------
    index : (ny, nx)
        Attractor of each start.
    x, y : (nx,), (ny,)
        Coordinates of the cells, evenly spaced.
    sections : list of (n, 2)
        Points of each attractor in the coordinates of the plane.

    Returns
    -------
    (attractors,)
        Exact to a cell; NaN where no point of the attractor lies on a cell of its own basin, or no start leads
        elsewhere.
    """
    out = np.full(len(sections), np.nan)
    if np.all(index == index[0, 0]):
        return out
    step = (y[1] - y[0], x[1] - x[0])
    for number, points in enumerate(sections):
        reach = distance_transform_edt(index == number, sampling=step)
        column, row = np.rint((points.T - [[x[0]], [y[0]]]) / np.array(step[::-1])[:, None]).astype(int)
        inside = (column >= 0) & (column < len(x)) & (row >= 0) & (row < len(y))
        found = reach[row[inside], column[inside]]
        if np.any(found > 0):
            out[number] = found[found > 0].min()
    return out
