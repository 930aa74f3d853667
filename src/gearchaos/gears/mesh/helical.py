"""Helical gears at rest under load: strips across the face width, each a spur pair, that share the load.

A strip is so narrow that its helix does not matter: it passes the mesh cycle of the transverse section, later than the
strip at the leading end of the face width by the overlap ratio times its distance from there. All strips give way
alike, and each tooth pair of a strip is a spring with a gap of its own: tip relief, corner contact, and what the lead
leaves open. Springs of neighbouring strips are independent, as in thin-slice models of tooth contact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from gearchaos.gears.mesh.tooth_pairs import PairsAlone, ToothPairs
from gearchaos.gears.stiffness import MeshStiffness, truncation_note
from gearchaos.gears.transmission_error.harmonics import ErrorHarmonics
from gearchaos.model import HarmonicStiffness
from gearchaos.model.static import shared_deflection, springs_at

STRIPS = 48  # for each mesh period by which one end of the width is behind the other, and one more
_FEW = 10  # strips that touch, below which a note says that the curves are coarse
_POSITIONS = 512  # in the mesh cycle, from which harmonics are computed
_ORDERS = 6  # harmonics of the stiffness and of the error, as many at every torque
_TOLERANCE = 0.02  # root mean square of the stiffness beside its harmonics, over the mean, above which a note says so


class AtRest(NamedTuple):
    """The strips at rest at n positions in the mesh cycle."""

    deflection: np.ndarray  # (n,) of the mesh along the line of action, m
    stiffness: np.ndarray  # (n,) by which the force grows with the deflection: of the pairs that touch, N/m
    pairs: np.ndarray  # (n,) tooth pairs that touch, each by its share of the width
    width: np.ndarray  # (n,) share of the face width on which at least one pair touches
    line_load: np.ndarray  # (n, strips, pairs) force over width along the line of action, N/m


@dataclass(frozen=True, kw_only=True)
class Strips:
    """A helical pair under a force, N, along the line of action in the transverse plane.

    ``pairs`` are the tooth pairs of the whole face width as if they were spur, ``reference`` the mean stiffness of
    those on their path, N/m. The lead is crowned by an amount at both ends of the face width, and one flank is turned
    against the other by a slope, m over the face width; both are gaps along the line of action.
    """

    pairs: ToothPairs
    reference: float
    overlap: float
    face_width: float
    force: float
    crowning: float = 0.0
    slope: float = 0.0

    @property
    def across(self) -> np.ndarray:
        """The middle of each strip (strips,), as a share of the face width from the leading end.

        One more than a multiple of the overlap, so that strips a mesh period apart are not at the same place in theirs.
        """
        count = STRIPS * max(math.ceil(self.overlap), 1) + 1
        return (np.arange(count) + 0.5) / count

    @property
    def first_age(self) -> int:
        """Mesh periods since the first of the tooth pairs of a strip entered its path; negative before."""
        stiffness = PairsAlone(self.reference, self.pairs).stiffness
        return int(stiffness.contacts(stiffness.numbers(), 1).age[0])

    def at(self, positions: np.ndarray) -> AtRest:
        """At rest at positions (n,) in the mesh cycle; at 0 a tooth pair enters contact at the leading end."""
        scale, across = PairsAlone(self.reference, self.pairs), self.across
        lead = self.crowning * (2 * across - 1) ** 2 + self.slope * across + max(-self.slope, 0.0)
        own = np.mod(np.asarray(positions, float)[:, None] - self.overlap * across, 1.0)
        stiffness, gap = (each.reshape(*own.shape, -1) for each in springs_at(scale.stiffness, own.ravel()))
        rows, strips = own.shape
        stiffness, gap = stiffness / strips, gap + lead[:, None] / scale.half_backlash
        force = self.force / (self.reference * scale.half_backlash)
        y = shared_deflection(stiffness.reshape(rows, -1), gap.reshape(rows, -1), np.array(force))
        pushed = np.maximum(y[:, None, None] - gap, 0.0) * stiffness
        touching = pushed > 0
        return AtRest(y * scale.half_backlash, (stiffness * touching).sum(axis=(1, 2)) * self.reference,
                      touching.sum(axis=(1, 2)) / strips, touching.any(axis=2).mean(axis=1),
                      pushed * (self.reference * scale.half_backlash * strips / self.face_width))

    @cached_property
    def cycle(self) -> AtRest:
        """At rest over the mesh cycle."""
        return _cycle(self)

    @property
    def stiffness(self) -> MeshStiffness:
        """The stiffness under the force, as a Fourier series about its mean."""
        curve = self.cycle.stiffness / self.cycle.stiffness.mean()
        amplitudes, phases, rest = _series(curve)
        error = float(np.sqrt(np.mean(rest**2)))
        fewest = round(float(self.cycle.width.min()) * len(self.across))
        few = (f"at some positions only {fewest} of {len(self.across)} strips across the width touch: stiffness and "
               "error are coarse",) if fewest < _FEW else ()
        return MeshStiffness(float(self.cycle.stiffness.mean()), HarmonicStiffness(amplitudes, phases), error,
                             "under load", (*truncation_note(error, _TOLERANCE), *few))

    @property
    def error(self) -> ErrorHarmonics:
        """What is left of the deflection beside that of the stiffness, force over stiffness: an error of the mesh, of
        which a spring of that stiffness has the same deflection under the force."""
        amplitudes, phases, rest = _series(self.cycle.deflection - self.force / self.cycle.stiffness)
        return ErrorHarmonics(amplitudes=amplitudes, phases=phases, source="load sharing under the torque",
                              residual_rms=float(np.sqrt(np.mean(rest**2))), residual_peak=float(np.abs(rest).max()))


@lru_cache(maxsize=1024)
def _cycle(strips: Strips) -> AtRest:
    return strips.at(np.arange(_POSITIONS) / _POSITIONS)


def _series(curve: np.ndarray) -> tuple[tuple[float, ...], tuple[float, ...], np.ndarray]:
    """Amplitudes and phases of the first harmonics of a curve over the mesh cycle (n,), and what it has beside them and
    its mean (n,)."""
    spectrum = np.fft.rfft(curve) / len(curve)
    kept = 2 * spectrum[1 : _ORDERS + 1]
    spectrum[: _ORDERS + 1] = 0.0
    rest = np.fft.irfft(spectrum * len(curve), len(curve))
    return tuple(np.abs(kept).tolist()), tuple((-np.angle(kept)).tolist()), rest
