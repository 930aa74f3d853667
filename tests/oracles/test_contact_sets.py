"""Several one-sided contacts in the flow: against an integration that shares no code, and in closed form."""

from dataclasses import replace

import numpy as np
import pytest

from gearchaos.flow import OK, ExactFlow
from gearchaos.model import MeshModel, SteppedStiffness, ToothPairStiffness, vary
from gearchaos.model.switched import switched_system
from tests.oracles.several_contacts import Contacts, Mesh, after_periods


def system_of(mesh: Mesh, count: int = 1):
    model = MeshModel.of(kind="single", omega=mesh.omega, zeta=mesh.zeta, q0=mesh.force, eps1=mesh.error,
                         damping_law=mesh.law)
    found = switched_system(vary(model.with_values({"stiffness": ToothPairStiffness()}), {}))
    return replace(found, contacts=found.contacts._replace(
        meshes=np.zeros(len(mesh.contacts.sides), np.int64), sides=mesh.contacts.sides, edges=mesh.contacts.edges[None],
        stiffness=mesh.contacts.stiffness[None], offset=mesh.contacts.gap[None] + np.array([1.0, 0.0, 0.0])))


def random_mesh(seed: int) -> tuple[Mesh, np.ndarray]:
    rng = np.random.default_rng(seed)
    m, n = int(rng.integers(1, 5)), int(rng.integers(1, 5))
    sides = np.where(np.arange(m) == 0, 1.0, rng.choice([-1.0, 1.0], m))
    stiffness = rng.uniform(0.3, 1.2, (m, n)) * (rng.random((m, n)) < 0.75)
    gap = rng.uniform(-1, 1, (m, n, 3)) * [0.15, 0.4, 0.5]
    if rng.random() < 0.3 and m > 1:  # two contacts that switch together
        sides[1], gap[1] = sides[0], gap[0]
    edges = np.append(0.0, np.sort(rng.uniform(0.05, 0.95, n - 1)))
    mesh = Mesh(Contacts(sides, edges, stiffness, gap), rng.uniform(0.5, 2.5), rng.uniform(0.02, 0.2),
                rng.choice([0.02, 0.1, 0.4]), rng.uniform(0, 0.2), str(rng.choice(["always", "contact"])))
    return mesh, np.array([rng.uniform(-1.5, 1.5), rng.uniform(-0.4, 0.4)])


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(30))
def test_random_contacts_agree_with_an_independent_integration(seed):
    mesh, start = random_mesh(seed)
    flow = ExactFlow(system_of(mesh))
    out = flow.advance(start[:, None], 2, tangent=np.eye(2)[:, :, None])
    growth = max(1.0, np.abs(out.tangent).max())
    assert out.status[0] == OK and np.abs(out.w[:, 0] - after_periods(mesh, start, 2)).max() < 1e-11 * growth


@pytest.mark.slow
@pytest.mark.parametrize(("ratio", "corner"), [
    (2.0, 0.0), (2.3, 0.0), (2.4, 0.25), (3.0, 0.15), (3.4, 0.0), (3.7, 0.25)])
@pytest.mark.parametrize("law", ["always", "contact"])
def test_three_and_four_pairs_at_a_time_agree_with_an_independent_integration(ratio, corner, law):
    """Pairs on their path, and up to thirteen with corner contact; on both flanks."""
    rng = np.random.default_rng(int(100 * ratio))
    pairs = ToothPairStiffness(
        (0.3, 0.4), (0.0, 0.35), ratio, *rng.uniform(0.02, 0.2, 2), relief_exponent=2.0, crowning=0.03, back_phase=0.41,
        corner1=(8.0,) * (corner > 0), corner2=(11.0,) * (corner > 0), corner_length1=corner, corner_length2=corner)
    found = pairs.contacts(pairs.numbers(), 1)
    mesh = Mesh(Contacts(found.sides.astype(float), found.edges[0], found.stiffness[0], found.gap[0]),
                float(rng.uniform(0.7, 1.4)), 0.05, 0.25, 0.05, law)
    at_once = (found.stiffness[0] > 0)[found.sides > 0].sum(axis=0).max()
    assert at_once >= np.ceil(ratio) and (len(found.sides) > 8) == (corner > 0)  # contacts are computed by eights
    flow = ExactFlow(system_of(mesh))
    for start in ([1.3, 0.2], [-1.2, 0.9]):
        out = flow.advance(np.array(start)[:, None], 1, tangent=np.eye(2)[:, :, None])
        growth = max(1.0, np.abs(out.tangent).max())
        assert out.status[0] == OK
        assert np.abs(out.w[:, 0] - after_periods(mesh, np.array(start), 1)).max() < 1e-11 * growth


def test_equal_contacts_are_one_spring():
    contacts = Contacts(np.array([1.0, 1.0, -1.0]), np.array([0.0, 0.4]),
                        np.array([[0.6, 0.5], [0.4, 0.3], [1.0, 0.8]]), np.zeros((3, 2, 3)))
    mesh = Mesh(contacts, 0.9, 0.05, 0.1, 0.05, "contact")
    model = MeshModel.of(kind="single", omega=0.9, zeta=0.05, q0=0.1, eps1=0.05, damping_law="contact",
                         stiffness=SteppedStiffness((1.0, 0.8), (0.0, 0.4)))
    start = np.array([[1.2, -1.4, 0.3], [0.4, 0.1, -0.6]])
    several, single = ExactFlow(system_of(mesh)), ExactFlow(switched_system(vary(model, {})))
    options = {"points": np.zeros(3, int), "tangent": np.repeat(np.eye(2)[:, :, None], 3, 2), "measured": True}
    a, b = several.advance(start, 10, **options), single.advance(start, 10, **options)
    assert np.abs(a.w - b.w).max() < 1e-12
    assert np.abs(a.tangent - b.tangent).max() < 1e-11 * np.abs(b.tangent).max()
    assert np.allclose(a.measures[:15], b.measures[:15], rtol=1e-11, atol=1e-12)  # the others are of several alone
