"""Measures of basin boundaries: entropy, uncertainty exponent, and distance of the attractors from them."""

from __future__ import annotations

import numpy as np

_BOX = 5
"""Side of the boxes of the basin entropy, in cells."""

_DISTANCES = (1, 2, 4, 8, 16)
"""Distances ε at which the share of uncertain cells is taken, in cells."""


def entropy(index: np.ndarray) -> tuple[float, float]:
    """Basin entropy and boundary basin entropy, in nats.

    Parameters
    ----------
    index : (ny, nx)
        Number of the attractor that each cell of a plane of initial values leads to.

    Returns
    -------
    basin_entropy : float
        Mean of −Σ p ln p over boxes of 5 × 5 cells, p being the shares of the attractors in a box. NaN for a plane
        smaller than a box.
    boundary_basin_entropy : float
        The mean over the boxes with more than one attractor; above ln 2 the boundary is fractal. NaN if there are none.

    Notes
    -----
    A. Daza, A. Wagemakers, B. Georgeot, D. Guéry-Odelin, M. A. F. Sanjuán, *Basin entropy*, Sci. Rep. 6 (2016) 31416.
    """
    ny, nx = (n // _BOX * _BOX for n in index.shape)
    boxes = index[:ny, :nx].reshape(ny // _BOX, _BOX, nx // _BOX, _BOX).swapaxes(1, 2).reshape(-1, _BOX**2)
    shares = np.stack([(boxes == k).mean(axis=1) for k in np.unique(index)], axis=1)
    entropies = -np.sum(shares * np.log(np.where(shares > 0, shares, 1.0)), axis=1)
    mixed = shares.max(axis=1, initial=0.0) < 1
    return _mean(entropies), _mean(entropies[mixed])


def _mean(values: np.ndarray) -> float:
    """The mean, NaN of no values."""
    return float(values.mean()) if len(values) else float("nan")


def uncertainty_exponent(index: np.ndarray) -> float:
    """The uncertainty exponent α of a basin boundary, f(ε) ~ ε^α.

    Parameters
    ----------
    index : (ny, nx)
        Number of the attractor that each cell of a plane of initial values leads to.

    Returns
    -------
    float
        f(ε) is the share of the cells whose neighbour at distance ε leads to another attractor. α is 1 for a smooth
        boundary and smaller for a fractal one, whose dimension is 2 − α. NaN without a boundary, or for a plane of
        less than 64 cells a side.

    Notes
    -----
    C. Grebogi, S. W. McDonald, E. Ott, J. A. Yorke, *Final state sensitivity*, Phys. Lett. A 99 (1983) 415.
    """
    if min(index.shape) < 4 * _DISTANCES[-1]:
        return float("nan")
    share = [0.5 * ((index[:, k:] != index[:, :-k]).mean() + (index[k:] != index[:-k]).mean()) for k in _DISTANCES]
    if share[0] == 0:
        return float("nan")
    return float(np.polyfit(np.log(_DISTANCES), np.log(share), 1)[0])


def smallest_perturbations(
    index: np.ndarray, x: np.ndarray, y: np.ndarray, sections: list[np.ndarray]
) -> np.ndarray:
    """Distance of each attractor from the boundary of its basin, in a plane of initial values.

    Parameters
    ----------
    index : (ny, nx)
        Number of the attractor that each cell leads to.
    x, y : (nx,), (ny,)
        Coordinates of the cells, evenly spaced.
    sections : list of (n, 2)
        Stroboscopic points of each attractor in the coordinates of the plane.

    Returns
    -------
    (attractors,)
        Smallest distance of a stroboscopic point from a cell that does not lead to the attractor, to the accuracy of a
        cell. NaN where no point lies in a cell of the attractor's own basin, or all cells lead to one attractor.
    """
    from scipy.ndimage import distance_transform_edt  # here, since it takes a tenth of a second to load

    out = np.full(len(sections), np.nan)
    if np.all(index == index[0, 0]):
        return out
    step = (y[1] - y[0], x[1] - x[0])
    for number, points in enumerate(sections):
        distance = distance_transform_edt(index == number, sampling=step)
        column, row = np.rint((points.T - [[x[0]], [y[0]]]) / np.array(step[::-1])[:, None]).astype(int)
        inside = (column >= 0) & (column < len(x)) & (row >= 0) & (row < len(y))
        found = distance[row[inside], column[inside]]
        if np.any(found > 0):
            out[number] = found[found > 0].min()
    return out
