"""One-sided contacts of a mesh, which push where they are closed and never pull."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class OneSidedContacts(NamedTuple):
    """M contacts of the displacement z at P points, on N pieces of the mesh period.

    Contact e is closed while side_e z − 1 − gap_e is positive, and pushes with its stiffness times that.
    """

    sides: np.ndarray  # (M,) 1 on the front flank, -1 on the back flank
    edges: np.ndarray  # (P, N) where pieces begin, ascending from 0, as fractions of the mesh period
    stiffness: np.ndarray  # (P, M, N) over c0; 0 where a contact is absent
    gap: np.ndarray  # (P, M, N, 3) coefficients in the time since the piece began, in mesh periods; half backlashes

    def take(self, index: np.ndarray) -> OneSidedContacts:
        """The contacts at the points with these indices (K,), in that order."""
        return self._replace(edges=self.edges[index], stiffness=self.stiffness[index], gap=self.gap[index])

    def reversed_in_time(self) -> OneSidedContacts:
        """The contacts at the phase 1 − φ."""
        edges = np.hstack([self.edges, np.ones((len(self.edges), 1))])
        length = np.diff(edges, axis=1)[:, None, :]
        a, b, c = (self.gap[..., k] for k in range(3))
        gap = np.stack([a + length * (b + length * c), -b - 2 * length * c, c], axis=-1)
        return self._replace(edges=1.0 - edges[:, :0:-1], stiffness=self.stiffness[:, :, ::-1], gap=gap[:, :, ::-1])
