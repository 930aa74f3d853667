"""Motions with several contacts do not depend on the steps in which they are advanced."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from gearchaos.flow import ExactFlow, contact_tables
from gearchaos.model import MeshModel, ToothPairStiffness, vary
from gearchaos.model.switched import switched_system

PAIRS = ToothPairStiffness((0.7,), (0.0,), 1.6)
KINDS = {
    "path alone": PAIRS,
    "relief": replace(PAIRS, relief1=0.2, relief2=0.2, relief_length1=0.25, relief_length2=0.25),
    "corner contact": replace(PAIRS, corner1=(38.8, 22.6), corner2=(30.0, 25.0), corner_length1=0.19,
                              corner_length2=0.17),
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("omega", [0.4, 1.3])
def test_a_motion_is_the_same_in_steps_of_other_lengths(kind, omega):
    """Where a gap opens and closes within a step, it does so within two others; many of these states graze."""
    system, w = switched_system(vary(model(kind, omega), {})), states(20_000)
    points, tangent = np.zeros(w.shape[1], int), np.repeat(np.eye(2)[:, :, None], w.shape[1], 2)
    one, other = (ExactFlow(system, samples).advance(w, 1, points=points, tangent=tangent) for samples in (0, 41))
    apart = np.abs(one.w - other.w).max(axis=0)
    assert np.quantile(apart, 0.99) < 1e-12 and apart.max() < 1e-7  # a graze costs half of the digits
    assert np.quantile(np.abs(one.tangent - other.tangent).max(axis=(0, 1)), 0.98) < 1e-9


def test_a_motion_is_the_same_with_room_for_few_contact_sets(monkeypatch):
    """When the room is used up the sets met so far are made anew."""
    system, w = switched_system(vary(model("corner contact", 0.7), {})), states(300)
    points = np.zeros(300, int)
    enough = ExactFlow(system).advance(w, 20, points=points)
    monkeypatch.setattr(contact_tables, "_SETS", 2)
    few = ExactFlow(system).advance(w, 20, points=points)
    assert np.array_equal(enough.w, few.w)


def test_samples_split_the_pieces_of_a_long_period_in_little_memory():
    """Each sample begins a piece, or coincides with a change of stiffness; no array has the size of all their pairs."""
    changes = np.random.default_rng(2).random(1300)
    edges = np.unique(np.concatenate([[0, 1], np.arange(0, 20_000, 30) / 20_000, changes]))
    tracemalloc.start()
    new, piece, begin, sample = contact_tables._split(edges, 20_000)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 20 * 8 * (len(edges) + 20_000)
    assert np.array_equal(np.unique(new), np.unique(np.concatenate([edges, np.arange(20_000) / 20_000])))
    assert np.array_equal(edges[piece] + begin, new[:-1])
    assert new[:-1][sample >= 0] == pytest.approx(np.arange(20_000) / 20_000, abs=1e-12)


def model(kind, omega):
    return MeshModel.of(kind="single", omega=omega, zeta=0.05, q0=0.06, eps1=0.3, damping_law="contact",
                        stiffness=KINDS[kind])


def states(count):
    rng = np.random.default_rng(5)
    return np.stack([rng.uniform(-1.4, 1.4, count), rng.uniform(-1.5, 1.5, count)])
