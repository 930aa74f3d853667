"""Teeth that differ from the others of their wheel, by faults or pitch deviations, and the contacts of a turn.

Teeth are counted from 1 in the order in which they mesh; the first ones of both wheels meet in the mesh cycle 0.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from gearchaos.errors import InputError
from gearchaos.model.contacts import OneSidedContacts


def check_pitch(deviations: Sequence[Sequence[float]], teeth: Sequence[int]) -> None:
    """Raise `InputError` for deviations of more or fewer teeth than a wheel has."""
    for i, (values, z) in enumerate(zip(deviations, teeth, strict=True)):
        if len(values) not in (0, z):
            raise InputError(f"pitch_errors[{i}]", f"must have {z} values, one for each tooth of wheel {i + 1}",
                             len(values), "Or none, [], for a wheel without deviations.")


class _Wheel(NamedTuple):
    """The teeth of one wheel, each (z,)."""

    stiffness_share: np.ndarray  # share of the stiffness that is left
    late: np.ndarray  # by how much a tooth comes too late, m
    back: np.ndarray  # by how much its driving flank stands back, m


def _wheels(mesh: Any) -> Iterator[_Wheel]:
    for i, z in enumerate(mesh.teeth):
        late = np.array(mesh.pitch_errors[i] or np.zeros(z)) if mesh.pitch_errors else np.zeros(z)
        wheel = _Wheel(np.ones(z), late, np.zeros(z))
        for fault in mesh.faults:
            if fault.wheel == i + 1:
                wheel.stiffness_share[fault.tooth - 1], wheel.back[fault.tooth - 1] = fault.stiffness_share, fault.back
        yield wheel


def uneven_wheels(mesh: Any) -> list[int]:
    """The wheels of a mesh, 0 and 1, with teeth that are not those of the healthy mesh; all late alike are."""
    return [i for i, wheel in enumerate(_wheels(mesh))
            if np.any(wheel.stiffness_share != 1) or np.any(wheel.back) or np.ptp(wheel.late) > 0]


def as_pairs(one: OneSidedContacts, contact_ratio: float) -> OneSidedContacts:
    """The contacts of a mesh cycle with a spring for each tooth pair, where ``one`` has one spring on each flank: the
    pairs that are in contact by the contact ratio have equal shares of its stiffness."""
    last = contact_ratio % 1.0
    edges = np.union1d(one.edges[0], [last])
    age = np.arange(math.ceil(contact_ratio - 1e-12))
    middle = (edges + np.append(edges[1:], 1.0)) / 2
    total = one.stiffness[0, 0, np.searchsorted(one.edges[0], middle, side="right") - 1]
    carries = middle + age[:, None] < contact_ratio
    share = np.tile(np.where(carries, total / carries.sum(axis=0), 0.0), (2, 1))
    return OneSidedContacts(np.repeat([1, -1], len(age)), np.tile(age, 2), edges[None], share[None],
                            np.zeros((1, *share.shape, 3)))


def uneven_contacts(mesh: Any, part: OneSidedContacts, cycles: int) -> OneSidedContacts:
    """The contacts of a mesh over the common period of so many of its cycles, ``part``, with what the teeth that mesh
    in each have of their own; stiffnesses in N/m, gaps in m."""
    edges, sides = part.edges[0], part.sides[:, None]
    cycle = np.floor((edges + np.append(edges[1:], 1.0)) / 2 * cycles + mesh.phase / (2 * np.pi)).astype(int)
    age, (first, second) = part.age[:, None], _wheels(mesh)
    # behind the tooth n of the first wheel, which pushes n of the second, is n + 1: its back flank touches that
    n1, n2 = (cycle - age) % len(first.stiffness_share), (cycle - age + (sides < 0)) % len(second.stiffness_share)
    gap = part.gap.copy()
    gap[0, :, :, 0] += sides * (first.late[n1] - second.late[n2]) + (sides > 0) * (first.back[n1] + second.back[n2])
    stiffness = part.stiffness * (first.stiffness_share[n1] * second.stiffness_share[n2])
    return part._replace(stiffness=stiffness, gap=np.where(stiffness[..., None] > 0, gap, 0.0))
