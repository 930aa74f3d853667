"""The states that a change of the load leaves: what a reversed load stores in the mesh, drawn evenly.

The load goes away or reverses to −λT for any time, and comes back. At the worst instant, the turning point of the
motion that the step to −λT begins at rest, without damping, the mesh stores the most. The motion before the change has
energy of its own: its velocity may add to that of the change. All states with at most this energy under the load that
is back are drawn evenly over their displacement and velocity. Without damping and excitation the motion leaves such a
distribution as it is (Liouville), so that states at the beginning of the mesh period stand for those at any phase.

Of the states after reversals at random phases, sudden ones and ramps, single and repeated, 99.9 % are in this set. Of
those after changes to other loads 98.7 % are in the set of their own λ: the others follow falls to a small load of the
same sign, under which the error of the teeth parts them. See `benchmarks/load_changes.py`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple, Protocol

import numpy as np

from gearchaos.dynamics.initial_conditions import default_box, spread
from gearchaos.model import MeshModel, vary
from gearchaos.model.switched import SwitchedAffine, coordinates, switched_system
from gearchaos.quantities import Rule
from gearchaos.studies.core.initial_value_problems import initial_states
from gearchaos.validation import check_rule, to_float

LOAD_CHANGES = Rule(lambda v: (v > -1) & (v <= 3), "must be greater than -1, at most 3",
                    "The load goes to −λT: 1 is a reversal, 0 a lost load, -0.5 a fall to half.")
CHANGE = "The load is -LAMBDA times itself for a time: 1 reversal, 0 loss, -0.5 half."
"""What λ is, for users."""

_ANGLES = 257  # of the displacements over which states are drawn
_MOST_FACTOR = 2.0  # of the motion before: where it is larger the speed is to be avoided in any case


class StateSampler(Protocol):
    """Draws states (d, n) of a model, some at each of P points, which stand one after another.

    ``values`` (P,) are those of parameters by name, ``factors`` (P,) the dynamic factors of the motions before, NaN for
    one without bound."""

    def __call__(self, model: MeshModel, values: Mapping[str, np.ndarray], factors: Sequence[float] | np.ndarray,
                 starts: int, seed: tuple[int, ...], /) -> np.ndarray: ...


class LoadChange(NamedTuple):
    """States after the load has gone to −λT and come back, a `StateSampler`."""

    ratio: float = 1.0

    @classmethod
    def checked(cls, ratio: Any) -> LoadChange:
        """That of a number λ; raises `InputError` if it is out of bounds."""
        value = to_float("load_change", ratio)
        check_rule("load_change", value, LOAD_CHANGES)
        return cls(value)

    @property
    def words(self) -> str:
        """The change in words: "a reversal of the load"."""
        named = {1.0: "a reversal of the load", 0.0: "a loss of the load"}
        share = f"{100 * abs(self.ratio):.6g} %"
        return named.get(self.ratio, f"a {'fall' if self.ratio < 0 else 'reversal'} of the load to {share}")

    def __call__(self, model: MeshModel, values: Mapping[str, np.ndarray], factors: Sequence[float] | np.ndarray,
                 starts: int, seed: tuple[int, ...], names: tuple[str, ...] = ()) -> np.ndarray:
        base = replace(model, initial={})
        names = names or coordinates(vary(base, {}))
        meshes = Meshes.of(switched_system(vary(base, values), names))
        box = {f"{part}{k}": (0.0, 1.0) for k in range(len(meshes.front)) for part in ("z", "v")}
        unit = np.stack(list(spread(box, len(factors) * starts, seed).values()))
        return self.states(meshes, initial_states(base, values, names), factors, unit)

    def states(self, meshes: Meshes, rest: np.ndarray, factors: Any, unit: np.ndarray) -> np.ndarray:
        """States (d, n P) of K meshes at P points, n at each, from those at rest (d, P), the dynamic factors (P,) of
        the motions before, and even numbers between 0 and 1 (2 K, n P)."""
        excess = np.fmin(np.nan_to_num(factors, nan=np.inf), _MOST_FACTOR) - 1
        drawn = unit.reshape(len(meshes.front), 2, rest.shape[1], -1).copy()
        for k, front in enumerate(meshes.front.tolist()):
            for p, (mass, stiffness, force, own) in enumerate(zip(
                    *(each[:, k] for each in meshes[3:]), excess, strict=True)):
                stored, unit_x, unit_v = _stored(front, stiffness, abs(force), self.ratio, own), *drawn[k, :, p]
                x = np.interp(unit_x, stored.share, stored.displacement)
                v = (2 * unit_v - 1) * np.interp(x, stored.displacement, stored.velocity) / math.sqrt(mass)
                drawn[k, :, p] = np.stack([x, v]) * (-1.0 if force < 0 else 1.0)  # back flanks are a mirror image
        rest, both = np.repeat(rest, drawn.shape[-1], axis=1), np.stack([meshes.rows, meshes.rates], axis=1)
        both = both.reshape(len(unit), -1)
        return rest + np.linalg.pinv(both) @ (drawn.reshape(unit.shape) - both @ rest)


REVERSAL = LoadChange()
"""The change of the load unless another is given."""


class Meshes(NamedTuple):
    """K meshes at P points: rows of displacement and velocity (K, d), front flank (K,), mass, mean stiffness and mean
    force (P, K)."""

    rows: np.ndarray
    rates: np.ndarray
    front: np.ndarray
    mass: np.ndarray
    stiffness: np.ndarray
    force: np.ndarray

    @classmethod
    def of(cls, system: SwitchedAffine) -> Meshes:
        """The meshes of a system; the mean stiffness of a pair is 1."""
        contacts, force = system.contacts, system.static_force
        if contacts is None or not contacts.names:
            unit = np.eye(system.dimension)
            return cls(unit[:1], unit[1:2], np.ones(1), np.ones_like(force), np.ones_like(force), force)
        length = np.diff(contacts.edges, axis=1, append=1.0)
        mean = np.einsum("pmn,pn->pm", contacts.stiffness, length)
        stiffness = np.stack([mean[:, (contacts.meshes == k) & (contacts.sides > 0)].sum(axis=1)
                              for k in range(len(contacts.rows))], axis=1)
        return cls(contacts.rows, contacts.rates, contacts.front, 1 / np.einsum(
            "pkd,kd->pk", contacts.pushes, contacts.rates), stiffness, force)


class _Stored(NamedTuple):
    """What is stored under a load: displacements (A,) from the least to the largest, the velocities there for a mass of
    1, and the shares of the states at smaller ones."""

    displacement: np.ndarray
    velocity: np.ndarray
    share: np.ndarray


@lru_cache(maxsize=4096)
def _stored(front: float, stiffness: float, load: float, ratio: float, excess: float) -> _Stored:
    """The states of a mesh after a change of the load; the force before exceeded it by a share ``excess`` at most."""
    def beyond(force: float) -> float:  # the flank on which this force presses: k y²/2 − force (front + y) = energy
        root = force**2 + 2 * stiffness * (energy + force * front)
        return float((force + np.sqrt(max(0.0, root))) / stiffness)

    rest = -load * front - load**2 / (2 * stiffness)
    energy = rest + (math.sqrt(max(0.0, stored_energy(front, stiffness, load, ratio) - rest))
                     + excess * load / math.sqrt(2 * stiffness)) ** 2
    high = front + beyond(load)  # the ends of the motion, where it has no velocity
    if energy >= load * front:
        low = -front - beyond(-load)
    elif energy >= -load * front:
        low = -energy / load if load else -front
    else:
        low = front + 2 * load / stiffness - (high - front)
    angle = np.linspace(0, np.pi, _ANGLES)
    x = (low + high) / 2 - (high - low) / 2 * np.cos(angle)
    velocity = np.sqrt(np.maximum(0.0, 2 * (energy + load * x - _strain(x, front, stiffness))))
    share = np.cumsum((velocity if velocity.max() > 0 else 1.0) * np.sin(angle))
    return _Stored(x, velocity, share / share[-1])


def stored_energy(front: float, stiffness: float, load: float, ratio: float) -> float:
    """The most energy, under a load F ≥ 0, that its change to −λF leaves in a mesh with flanks at ±``front``: that at
    the turning point of the motion without damping from rest under F."""
    at_rest = front + load / stiffness
    total = load**2 / (2 * stiffness) + ratio * load * at_rest  # U(x) + λF x along the motion
    # beyond the back flank by y: k y²/2 − λF (front + y) = total; in the gap without a spring λF x = total
    behind = total + ratio * load * front
    if behind >= 0:
        turn = -front - (ratio * load + np.sqrt((ratio * load) ** 2 + 2 * stiffness * behind)) / stiffness
    elif total / (ratio * load) <= front:
        turn = total / (ratio * load)
    else:  # the teeth stay in contact: it swings about the new rest
        turn = front - (2 * ratio + 1) * load / stiffness
    return float(_strain(turn, front, stiffness) - load * turn)


def _strain(x: Any, front: float, stiffness: float) -> Any:
    """The energy of the spring at displacements."""
    return stiffness / 2 * np.maximum(0.0, np.abs(x) - front) ** 2


def wide_states(
    model: MeshModel, values: Mapping[str, np.ndarray], factors: Sequence[float] | np.ndarray, starts: int,
    seed: tuple[int, ...],
) -> np.ndarray:
    """States from the ranges that `gearchaos.attractors` takes by default, a `StateSampler`: affine functions of the
    initial values, by those at the origin and at the unit vectors of each point."""
    names = coordinates(vary(model, {}))
    conditions = spread(default_box(model), len(factors) * starts, seed)
    base = replace(model, initial={}) if model.kind == "single" else model
    corners = np.vstack([np.zeros(len(conditions)), np.eye(len(conditions))])
    at_corners = dict(zip(conditions, np.tile(corners, (len(factors), 1)).T, strict=True))
    at_points = {n: np.repeat(v, len(corners)) for n, v in values.items()}
    w = initial_states(base, at_points | at_corners, names)
    w = w.reshape(len(w), len(factors), len(corners))
    slopes, given = w[..., 1:] - w[..., :1], np.stack(list(conditions.values())).reshape(-1, len(factors), starts)
    return (w[..., :1] + np.einsum("dsn,nsk->dsk", slopes, given)).reshape(len(w), -1)
