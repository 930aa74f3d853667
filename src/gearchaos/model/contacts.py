"""One-sided contacts, which push where they are closed and never pull: those of one mesh, and those of several."""

from __future__ import annotations

from typing import NamedTuple, Self

import numpy as np


class OneSidedContacts(NamedTuple):
    """M contacts of the displacement z at P points, on N pieces of the mesh period.

    Contact e is closed while side_e z − 1 − gap_e is positive, and pushes with its stiffness times that.
    """

    sides: np.ndarray  # (M,) 1 on the front flank, -1 on the back flank
    age: np.ndarray  # (M,) int, mesh periods since its tooth pair entered its path; negative before
    edges: np.ndarray  # (P, N) where pieces begin, ascending from 0, as fractions of the mesh period
    stiffness: np.ndarray  # (P, M, N) over c0; 0 where a contact is absent
    gap: np.ndarray  # (P, M, N, 3) coefficients in the time since the piece began, in mesh periods; half backlashes


class MeshContacts(NamedTuple):
    """M contacts in K meshes at P points, on N pieces of the period, and the forcing of all d coordinates w.

    The displacement of mesh m is row_m·w, its velocity rate_m·w. Contact e of mesh m is closed while its gap
    g = side_e row_m·w − offset_e is positive; it adds −push_m side_e κ_e g to w', and, where the damping acts in
    contact alone, the mesh −push_m D_m rate_m·w while any of its contacts is closed. A contact that releases adds
    neither while the sum of both would pull.
    """

    names: tuple[str, ...]  # of the K meshes of a train; none of a pair
    front: np.ndarray  # (K,) displacement at which the front flanks touch
    rows: np.ndarray  # (K, d)
    rates: np.ndarray  # (K, d)
    pushes: np.ndarray  # (P, K, d)
    damping: np.ndarray  # (P, K) damping coefficient D of the mesh force
    in_contact: np.ndarray  # (K,) bool, whether the damping acts in contact alone; else it is a part of A
    releases: np.ndarray  # (K,) bool, whether contact ends where the force does; each flank is one spring then
    meshes: np.ndarray  # (M,) int
    sides: np.ndarray  # (M,) 1 on the front flank, -1 on the back flank
    edges: np.ndarray  # (P, N) where pieces begin, ascending from 0, as fractions of the period
    stiffness: np.ndarray  # (P, M, N); 0 where a contact is absent
    offset: np.ndarray  # (P, M, N, 3) coefficients in the time since the piece began, in periods
    orders: np.ndarray  # (H,) int, of the harmonics of the forcing
    f_cos: np.ndarray  # (P, H, d)
    f_sin: np.ndarray  # (P, H, d)

    @property
    def stiffest(self) -> np.ndarray:
        """Upper bound (P, K) of the stiffness of each mesh: of its front or back flank, whichever is larger."""
        flanks = [(self.meshes == m) & (self.sides == side) for m in range(len(self.rows)) for side in (1, -1)]
        sums = [self.stiffness[:, flank].sum(axis=1).max(axis=1) for flank in flanks]
        return np.maximum(sums[::2], sums[1::2]).T

    def states(self, w: np.ndarray, phase: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Displacement, velocity, force and flank in contact (0, 1 or −1) of each mesh, each (S, K), in states w (S, d)
        at phases (S,) of the period, at the first point."""
        piece = np.searchsorted(self.edges[0], phase, side="right") - 1
        powers = (phase - self.edges[0, piece])[:, None] ** np.arange(3)
        displacement, velocity = w @ self.rows.T, w @ self.rates.T
        gap = self.sides * displacement[:, self.meshes] - np.einsum("msk,sk->sm", self.offset[0][:, piece], powers)
        stiffness = self.stiffness[0][:, piece].T
        closed = (gap > 0) & (stiffness > 0)
        damper = self.sides * (self.damping[0] * velocity)[:, self.meshes]
        closed &= ~self.releases[self.meshes] | (stiffness * gap + damper > 0)
        force = np.zeros_like(displacement)
        flank = np.zeros(displacement.shape, np.int8)
        for m in range(len(self.rows)):
            own = self.meshes == m
            force[:, m] = (np.where(closed, self.sides * stiffness * gap, 0.0) * own).sum(axis=1)
            flank[:, m] = np.sign((closed * own * self.sides).sum(axis=1))
        damped = ~self.in_contact | (flank != 0)
        return displacement, velocity, force + damped * self.damping[0] * velocity, flank

    def take(self, index: np.ndarray) -> Self:
        """The contacts at the points with these indices, in that order."""
        names = ("pushes", "damping", "edges", "stiffness", "offset", "f_cos", "f_sin")
        return self._replace(**{name: getattr(self, name)[index] for name in names})

    def begun_at(self, phase: np.ndarray) -> Self:
        """The contacts with the phases (P,) of the period as its beginning; the forcing stays."""
        pieces = self.edges.shape[1]
        first = (self.edges <= phase[:, None]).sum(axis=1) - 1  # the piece in which each phase lies
        order = (first[:, None] + np.arange(pieces + 1)) % pieces
        since = phase - self.edges[np.arange(len(phase)), first]
        edges = wrapped(np.take_along_axis(self.edges, order, axis=1) - phase[:, None])
        offset = np.take_along_axis(self.offset, order[:, None, :, None], axis=2)
        (a, b, c), u = np.moveaxis(offset[:, :, 0], -1, 0), since[:, None]
        offset[:, :, 0] = np.stack([a + u * (b + u * c), b + 2 * u * c, c], axis=-1)
        return self._replace(edges=edges, offset=offset, stiffness=np.take_along_axis(
            self.stiffness, order[:, None], axis=2))

    def reversed_in_time(self, signs: np.ndarray) -> Self:
        """The contacts at the phase 1 − φ, in the coordinates times their ``signs`` (d,), −1 for velocities."""
        edges = np.hstack([self.edges, np.ones((len(self.edges), 1))])
        length = np.diff(edges, axis=1)[:, None, :]
        a, b, c = (self.offset[..., k] for k in range(3))
        offset = np.stack([a + length * (b + length * c), -b - 2 * length * c, c], axis=-1)
        return self._replace(
            edges=1.0 - edges[:, :0:-1], stiffness=self.stiffness[:, :, ::-1], offset=offset[:, :, ::-1],
            pushes=-signs * self.pushes, damping=np.where(self.in_contact, -self.damping, self.damping),
            f_cos=-signs * self.f_cos, f_sin=signs * self.f_sin)


def wrapped(starts: np.ndarray) -> np.ndarray:
    """Where pieces (P, N) begin in a period that begins within the first, as shares of it."""
    out = 1.0 - (-starts) % 1.0
    out[:, 0] = 0.0
    return np.asarray(out)
