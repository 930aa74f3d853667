"""The mesh at rest under a constant force: deflection, the springs that carry it, and where they jump."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from gearchaos.errors import InputError
from gearchaos.model.contacts import OneSidedContacts
from gearchaos.model.stiffness import Stiffness, ToothPairStiffness
from gearchaos.quantities import NOT_NEGATIVE
from gearchaos.validation import FINITE, check_rule


def static_deflection(stiffness: Stiffness, force: ArrayLike, phases: ArrayLike) -> np.ndarray:
    """The displacement z at rest on the front flank, without speed and without transmission error.

    Parameters
    ----------
    stiffness : Stiffness
    force : (...)
        Mesh force over c0 Δ, at least 0.
    phases : (n,)
        Positions in the mesh cycle, τ/T.

    Returns
    -------
    (..., n)
        In half backlashes. The least gap of all pairs, without force.

    Raises
    ------
    InputError
        For anything else.

    Examples
    --------
    >>> import gearchaos as gc
    >>> pairs = gc.ToothPairStiffness(levels=(0.5,), contact_ratio=1.6, relief1=0.1, relief2=0.1)
    >>> static_deflection(pairs, 0.25, [0.3, 0.8]).round(3).tolist()
    [1.256, 1.5]
    """
    if not isinstance(stiffness, Stiffness):
        raise InputError("stiffness", "must be a mesh stiffness", stiffness, "That of a model is model.stiffness.")
    forces, at = _finite("force", force)[..., None], np.mod(_finite("phases", phases), 1.0)
    check_rule("force", forces, NOT_NEGATIVE)
    if at.ndim != 1:
        raise InputError("phases", "must be a list of positions in the mesh cycle", at.tolist())
    if not isinstance(stiffness, ToothPairStiffness):
        return 1.0 + forces / stiffness.at(at, 2 * np.pi)
    return 1.0 + shared_deflection(*springs_at(stiffness, at), forces)


def _finite(name: str, value: ArrayLike) -> np.ndarray:
    """Finite numbers as an array; raises `InputError` for others."""
    try:
        found = np.asarray(value, float)
    except (TypeError, ValueError):
        raise InputError(name, "must be numbers", value) from None
    check_rule(name, found, FINITE)
    return found


def static_contacts(stiffness: ToothPairStiffness, force: float, phases: np.ndarray) -> np.ndarray:
    """How many tooth pairs touch at rest on the front flank under a force over c0 Δ, at positions (n,); (n,) int."""
    acting, gap = springs_at(stiffness, np.mod(phases, 1.0))
    return np.asarray((gap < shared_deflection(acting, gap, np.array(force))[:, None]).sum(axis=1))


def static_jumps(stiffness: ToothPairStiffness, force: float) -> list[tuple[float, float, float, float]]:
    """Where the deflection at rest jumps, in the mesh cycle: before and after, the stiffness that acts after, and the
    force after while the deflection is still the one before."""
    contacts = stiffness.contacts(stiffness.numbers(), 1)
    edges, n = contacts.edges[0], np.arange(contacts.edges.shape[1])
    length = np.diff(edges, append=1.0)
    ends = shared_deflection(*_springs(contacts, n, length), np.array(force))
    acting, gap = _springs(contacts, n, 0 * length)
    begins = shared_deflection(acting, gap, np.array(force))
    closed = np.where(gap < begins[:, None], acting, 0.0).sum(axis=1)
    before = np.roll(ends, 1)
    pushing = (acting * np.maximum(0.0, before[:, None] - np.where(np.isfinite(gap), gap, 0.0))).sum(axis=1)
    return [(1 + before[i], 1 + begins[i], closed[i], pushing[i]) for i in n.tolist()
            if abs(before[i] - begins[i]) > 1e-12]


def springs_at(stiffness: ToothPairStiffness, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and gap (n, pairs) of the pairs on the front flank, at positions (n,) in [0, 1) of the mesh cycle."""
    contacts = stiffness.contacts(stiffness.numbers(), 1)
    piece = np.searchsorted(contacts.edges[0], at, side="right") - 1
    return _springs(contacts, piece, at - contacts.edges[0, piece])


def _springs(contacts: OneSidedContacts, piece: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and gap (n, pairs) of the pairs on the front flank, the time ``u`` (n,) after these pieces began."""
    front = contacts.sides > 0
    stiffness, a = contacts.stiffness[0][front][:, piece].T, contacts.gap[0][front][:, piece].transpose(1, 0, 2)
    gap = a[..., 0] + u[:, None] * (a[..., 1] + u[:, None] * a[..., 2])
    return stiffness, np.where(stiffness > 0, gap, np.inf)


def shared_deflection(stiffness: np.ndarray, gap: np.ndarray, force: np.ndarray) -> np.ndarray:
    """y (..., n) with Σ stiffness max(0, y − gap) = force, from pairs (n, pairs): with the k closest pairs closed
    y = (force + Σ stiffness gap)/Σ stiffness, and the right k is that of the least y."""
    order = np.argsort(gap, axis=1)
    stiffness, gap = (np.take_along_axis(v, order, axis=1) for v in (stiffness, gap))
    carried = np.cumsum(stiffness * np.where(np.isfinite(gap), gap, 0.0), axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        found = (force[..., None] + carried) / np.cumsum(stiffness, axis=1)
    return np.where(np.isfinite(gap), found, np.inf).min(axis=-1)
