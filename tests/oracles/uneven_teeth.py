"""Motions of a pair of wheels whose teeth differ, by SciPy's DOP853, from the fields of its `Train` alone.

The deflection is s = r1 φ1 − r2 φ2 − e(t), φ in each wheel's own sense of rotation. Tooth pair n begins with the mesh
cycle n, and ends when the contact ratio is over; it pushes where its own gap is closed. The integration is begun anew
where a gap closes or opens, and where a pair begins, ends, or changes its stiffness.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from tests.oracles.stored import stored

_AFTER_SWITCH = 1e-7  # of a mesh cycle, in which a gap that has just changed its sign is not watched


@stored(digits=10)
def forces(train: Any, start: np.ndarray, cycles: int, samples: int) -> np.ndarray:
    """The mesh force at instants of mesh cycles from the state (s, s') at t = 0, (cycles samples,)."""
    return Pair(train).follow(start, cycles, samples)


class Pair:
    """The equations of a train of two free wheels and a mesh of constant or stepped stiffness, or of tooth pairs."""

    def __init__(self, train: Any) -> None:
        (self.mesh,), (a, b) = train.meshes, train.bodies
        r1, r2 = self.mesh.base_radii
        self.drive = r1 * a.torque / a.inertia - r2 * b.torque / b.inertia
        self.compliance = r1**2 / a.inertia + r2**2 / b.inertia
        self.always = (self.mesh.damping_law or train.damping_law) == "always"
        self.frequency = self.mesh.teeth[0] * train.speed * 2 * math.pi / 60  # rad/s
        self.cycle = 2 * math.pi / self.frequency
        mesh, pairs = self.mesh, self.mesh.tooth_pairs
        self.ratio = pairs.contact_ratio if pairs else mesh.contact_ratio
        levels = getattr(mesh.stiffness, "levels", (mesh.stiffness,))
        self.levels, self.starts = (pairs.stiffness, pairs.starts) if pairs else (
            levels, getattr(mesh.stiffness, "starts", (0.0,)))
        self.errors = [(e, j + 1.0, mesh.error_phases[j] if j < len(mesh.error_phases) else 0.0)
                       for j, e in enumerate(mesh.error_amplitudes)]
        self.errors += [(e, 1 / z, phase) for e, z, phase in zip(
            mesh.eccentricity, mesh.teeth, mesh.eccentricity_phases, strict=True)]
        ends = [0.0, self.ratio, *(x * self.ratio if pairs else x for x in self.starts)]
        back = [self.ratio + pairs.back_phase - x for x in ends] if pairs else []
        self.marks = sorted({x % 1.0 for x in (*ends, *back)} | {0.0})

    def error(self, t: float, derivative: int) -> float:
        """e(t), or a derivative of it."""
        w = self.frequency
        return sum(e * (order * w) ** derivative * math.cos(order * w * t - phase + derivative * math.pi / 2)
                   for e, order, phase in self.errors)

    def contacts(self, phase: float) -> list[tuple[int, float, float]]:
        """Side, stiffness and gap of the tooth pairs at a time in mesh cycles."""
        found, mesh, pairs = [], self.mesh, self.mesh.tooth_pairs
        for side in (1, -1):
            late = pairs.back_phase if pairs and side < 0 else 0.0
            present = [n for n in range(math.floor(phase) - 9, math.floor(phase) + 1)
                       if 0 < phase - late - n < self.ratio]
            for n in present:
                progress = phase - late - n
                if pairs:
                    at = progress / self.ratio if side > 0 else 1 - progress / self.ratio
                    k = self.levels[sum(at >= x for x in self.starts) - 1]
                else:
                    k = self.levels[sum(phase % 1.0 >= x for x in self.starts) - 1] / len(present)
                gap = 0.0 if side > 0 else mesh.backlash
                for wheel, number, sign in ((1, n, 1), (2, n + (side < 0), -1)):
                    tooth = number % mesh.teeth[wheel - 1] + 1
                    if mesh.pitch_errors[wheel - 1]:
                        gap += side * sign * mesh.pitch_errors[wheel - 1][tooth - 1]
                    for fault in mesh.faults:
                        if (fault.wheel, fault.tooth) == (wheel, tooth):
                            k *= 1 - fault.stiffness_loss
                            gap += fault.wear * (side > 0)
                if k > 0:
                    found.append((side, k, gap))
        return found

    def force(self, y: np.ndarray, contacts: Any, closed: list[bool]) -> float:
        push = sum(side * k * (side * y[0] - gap) for (side, k, gap), c in zip(contacts, closed, strict=True) if c)
        return push + self.mesh.damping * y[1] * (self.always or any(closed))

    def follow(self, y: np.ndarray, cycles: int, samples: int) -> np.ndarray:
        first = self.mesh.phase / (2 * math.pi)
        instants, forces = first + np.arange(cycles * samples) / samples, np.zeros(cycles * samples)
        marks = np.add.outer(np.arange(math.floor(first), first + cycles + 1), self.marks).ravel()
        edges = [first, *marks[(marks > first) & (marks < first + cycles)], first + cycles]
        for start, end in pairwise(edges):
            inside = (instants >= start) & (instants < end)
            y, forces[inside] = self._piece(y, start, end, self.contacts((start + end) / 2), instants[inside])
        return forces

    def _piece(self, y: np.ndarray, t: float, end: float, contacts: Any, at: np.ndarray
               ) -> tuple[np.ndarray, np.ndarray]:
        """The state at the end of a piece, in mesh cycles, and the forces at instants in it."""
        out = np.zeros(len(at))
        closed = [side * y[0] - gap > 0 for side, _, gap in contacts]
        T, done, wait = self.cycle, 0, False
        while t < end:
            def right(t: float, y: np.ndarray, closed: list[bool] = closed) -> list[float]:
                force = self.force(y, contacts, closed)
                return [T * y[1], T * (self.drive - self.compliance * force - self.error(t * T, 2))]

            until = min(t + _AFTER_SWITCH, end) if wait else end
            events = [] if wait else [self._event(side, gap) for side, _, gap in contacts]
            run = solve_ivp(right, (t, until), y, "DOP853", rtol=1e-12, atol=1e-17, events=events, max_step=0.002,
                            dense_output=True)
            while done < len(at) and at[done] <= run.t[-1]:
                out[done] = self.force(run.sol(at[done]) if at[done] > t else y, contacts, closed)
                done += 1
            t, y, wait = run.t[-1], run.y[:, -1], not wait and run.status == 1
            if wait:
                flipped = [abs(side * y[0] - gap) < 1e-14 for side, _, gap in contacts]
                closed = [c != f for c, f in zip(closed, flipped, strict=True)]
        return y, out

    @staticmethod
    def _event(side: int, gap: float) -> Any:
        def event(t: float, y: np.ndarray) -> float:
            return side * y[0] - gap
        event.terminal = True
        return event
