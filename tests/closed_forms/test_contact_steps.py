"""Motions with several contacts do not depend on the steps in which they are advanced."""

from dataclasses import replace

import numpy as np
import pytest

from gearchaos.flow import ExactFlow
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
    """Where a gap opens and closes within a step, it does so within two others: 3000 states, of which many graze."""
    model = MeshModel.of(kind="single", omega=omega, zeta=0.05, q0=0.06, eps1=0.3, damping_law="contact",
                         stiffness=KINDS[kind])
    system, rng = switched_system(vary(model, {})), np.random.default_rng(5)
    w = np.stack([rng.uniform(-1.2, 1.2, 3000), rng.uniform(-0.4, 0.4, 3000)])
    points, tangent = np.zeros(3000, int), np.repeat(np.eye(2)[:, :, None], 3000, 2)
    one, other = (ExactFlow(system, samples).advance(w, 1, points=points, tangent=tangent, measured=True)
                  for samples in (0, 41))
    apart = np.abs(one.w - other.w).max(axis=0)
    assert np.quantile(apart, 0.98) < 1e-12 and apart.max() < 1e-7  # a graze costs half of the digits
    assert np.quantile(np.abs(one.tangent - other.tangent).max(axis=(0, 1)), 0.98) < 1e-9
