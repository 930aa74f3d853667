"""The damping laws of the mesh in the flow: against an independent integration, in closed form, and by definition."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from gearchaos.continuation.family import ParameterFamily
from gearchaos.dynamics.orbits import mean_trace
from gearchaos.flow import OK, ExactFlow, Measure
from gearchaos.model import (
    COORDINATES,
    HarmonicStiffness,
    MeshModel,
    SteppedStiffness,
    TransmissionError,
    TwoLevelStiffness,
)
from gearchaos.model.switched import reversed_in_time, velocity_signs
from tests.flows import central_difference, flow_of
from tests.flows import unit_vectors as unit
from tests.oracles import scipy_oracle

LAWS = ("contact", "unilateral")


def random_model(law: str, seed: int) -> MeshModel:
    """A model of any kind and stiffness, lightly or heavily loaded, on either flank, from a state of any flank."""
    rng = np.random.default_rng(seed)
    kind = str(rng.choice(["single", "torsional", "full"]))
    stiffness = (
        TwoLevelStiffness(*rng.uniform(-0.2, 0.7, 2), rng.uniform(1.05, 1.95)),
        SteppedStiffness(tuple(rng.uniform(0.5, 1.8, 4)), tuple(np.sort(rng.uniform(0, 1, 4)))),
        HarmonicStiffness(tuple(rng.uniform(-0.3, 0.3, 2)), tuple(rng.uniform(0, 6, 2))),
    )[rng.integers(3)]
    load = rng.choice([-1, 1]) * rng.choice([rng.uniform(0, 0.02), rng.uniform(0.02, 0.4), rng.uniform(0.4, 1.5)])
    start = dict(zip(COORDINATES[kind], rng.uniform(-1, 1, len(COORDINATES[kind])), strict=True))
    start["z" if kind == "single" else "x1"] = rng.uniform(-1.8, 1.8)
    lateral = {"kappa1": 0.6, "kappa2": 0.6} if kind == "full" else {}
    return MeshModel(
        kind=kind, omega=rng.uniform(0.3, 3), zeta=rng.uniform(0.005, rng.choice([0.1, 0.5])), q1=load, q2=load,
        error=TransmissionError(tuple(rng.uniform(0, (0.3, 0.08))), tuple(rng.uniform(0, 6, 2))), stiffness=stiffness,
        damping_law=law, initial=start, **lateral)


def difference(model: MeshModel) -> tuple[float, int, float]:
    """Largest difference of a coordinate from the oracle's after up to 20 periods, their number, and the growth of
    disturbances over them."""
    flow, w = flow_of(model)
    for periods in (20, 3, 1):
        out = flow.advance(w, periods, tangent=unit(w))
        if (growth := float(np.abs(out.tangent).max())) < 100:
            break
    assert out.status[0] == OK
    end = {name: values[-1] for name, values in scipy_oracle.section(model, periods).items()}
    if "y1" in end:
        end |= {"y": end["y1"] - end["y2"], "y_dot": end["y1_dot"] - end["y2_dot"]}
    expected = np.array([end[name] for name in flow.system.names])
    return float(np.abs(out.w[:, 0] - expected).max()), periods, growth


def daily(chosen: dict[str, tuple[int, ...]], seeds: Sequence[int]) -> list:
    """Laws and seeds; those that are not chosen are exhaustive. Unilateral with supports has a kernel of its own."""
    return [pytest.param(law, seed, marks=[] if seed in chosen[law] else [pytest.mark.exhaustive])
            for law in LAWS for seed in seeds]


@pytest.mark.slow
@pytest.mark.parametrize(("law", "seed"), daily(
    {"contact": (1110, 1111, 1112, 1113, 1114), "unilateral": (1112, 1114, 1115, 1116, 1120)}, range(1110, 1130)))
def test_random_motions(law, seed):
    assert difference(random_model(law, seed))[0] <= 1e-10


@pytest.mark.slow
@pytest.mark.parametrize("zeta", [0.9, 2.0])
@pytest.mark.parametrize("law", LAWS)
def test_heavily_damped_motions(law, zeta):
    model = MeshModel.of(kind="single", omega=0.7, zeta=zeta, q0=0.05, eps1=0.3, z=1.5, z_dot=-1.0, damping_law=law)
    flow, w = flow_of(model)
    assert flow.advance(w, 20, measured=True).measures[Measure.SWITCHES, 0] > 10
    assert difference(model)[:2] < (1e-11, 21)


@pytest.mark.slow
@pytest.mark.parametrize("speed", [0.0, 1e-12, -1e-12, 1e-9, -1e-9, 1e-6, -1e-6, 0.3, -0.3])
@pytest.mark.parametrize("z", [1.0, -1.0])
@pytest.mark.parametrize("law", LAWS)
def test_one_period_from_the_boundary(law, z, speed):
    for phase in (0.0, 2.0, 4.0):
        model = MeshModel.of(
            kind="single", omega=0.8, zeta=0.1, q0=0.1, eps1=0.2, theta1=phase, z=z, z_dot=speed, damping_law=law)
        end, (flow, w) = scipy_oracle.section(model, 1), flow_of(model)
        expected = [end["z"][0], end["z_dot"][0]]
        np.testing.assert_allclose(flow.advance(w, 1).w[:, 0], expected, rtol=0, atol=1e-11)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("zeta", [0.02, 0.3, 0.7])
def test_an_impact_in_closed_form(law, side, zeta):
    """z'' + 2ζz' + z − 1 = 0 in contact, which ends after half a damped period, or at z'' = 0; free flight else."""
    speed, start, omega, angle = 0.9, 0.4, 1.2, np.arccos(zeta)
    model = MeshModel.of(
        kind="single", omega=omega, zeta=zeta, q0=0.0, chi1=0.0, chi2=0.0, z=side * start, z_dot=side * speed,
        damping_law=law)
    duration = (np.pi if law == "contact" else 2 * angle) / np.sin(angle)
    back = speed * np.exp(-zeta * duration)
    left_at = 1 + back * np.sin(duration * np.sin(angle)) / np.sin(angle)
    flight = 2 * np.pi / omega - (1 - start) / speed - duration
    flow, w = flow_of(model)
    out = flow.advance(w, 1, tangent=unit(w), measured=True)
    np.testing.assert_allclose(out.w[:, 0], side * np.array([left_at - back * flight, -back]), rtol=0, atol=1e-13)
    time, other, switches, top, bottom = out.measures[
        [Measure.FRONT_TIME, Measure.BACK_TIME, Measure.SWITCHES, Measure.FORCE_MAX, Measure.FORCE_MIN], 0]
    if side < 0:
        time, other, top, bottom = other, time, -bottom, -top
    assert (other, switches) == (0.0, 2.0) and time == pytest.approx(duration, abs=1e-13)
    least = min(3 * angle, np.pi) / np.sin(angle)  # the instant of the least force, or the end of contact
    pull = -speed * np.exp(-zeta * least) * (1 if 3 * angle < np.pi else 2 * zeta) if law == "contact" else 0.0
    assert bottom == pytest.approx(pull, abs=1e-13) and top >= 2 * zeta * speed - 1e-13
    assert np.linalg.det(out.tangent[:, :, 0]) == pytest.approx(np.exp(-2 * zeta * duration), rel=1e-12)


@pytest.mark.parametrize("law", ["always", *LAWS])
def test_nothing_acts_in_the_gap(law):
    """Half a turn between the flanks keeps the speed, bit for bit, but for the law that damps there."""
    model = MeshModel.of(kind="single", omega=2.0, zeta=0.1, q0=0.0, z=-0.4, z_dot=0.25, damping_law=law)
    flow, w = flow_of(model)
    out = flow.advance(w, 1, measured=True)
    force = out.measures[[Measure.FORCE_MAX, Measure.FORCE_MIN], 0]
    if law == "always":
        assert out.w[1, 0] == pytest.approx(0.25 * np.exp(-0.2 * np.pi), rel=1e-14) and force[1] > 0
    else:
        assert out.w[1, 0] == 0.25 and np.all(force == 0)


@pytest.mark.parametrize("law", LAWS)
def test_the_mesh_force_and_the_time_in_contact(law):
    """Of an oracle's trajectory, where the contact state follows from z and the force."""
    model = MeshModel.of(
        kind="single", omega=0.9, zeta=0.3, q0=0.03, eps1=0.3, z=1.5, z_dot=-0.5, chi1=0.3, chi2=0.2, damping_law=law)
    flow, w = flow_of(model)
    measures = flow.advance(w, 4, measured=True).measures[:, 0]
    taus = np.arange(0.5, 800) * 4 * model.period / 800
    motion = scipy_oracle.trajectory(model, taus)
    z, z_dot, turn = motion["z"], motion["z_dot"], taus / model.period % 1
    side = np.sign(z) * (np.abs(z) > 1)
    force = np.abs(side) * (2 * model.zeta * z_dot + np.where(turn < 0.5, 1.3, 0.8) * (z - side))
    if law == "unilateral":
        side, force = side * (side * force > 0), np.where(side * force > 0, force, 0.0)
    for measure, sign in ((Measure.FRONT_TIME, 1), (Measure.BACK_TIME, -1)):
        assert measures[measure] / (4 * model.period) == pytest.approx(np.mean(side == sign), abs=5e-3)
        assert measures[measure] > 0.1
    assert measures[Measure.FORCE_MAX] == pytest.approx(force.max(), abs=0.02)
    assert measures[Measure.FORCE_MIN] == pytest.approx(force.min(), abs=0.02)


def test_a_contact_that_cannot_pull_does_not():
    """On the front flank alone, with jumps of the stiffness that end contact."""
    found = {}
    for law in LAWS:
        model = MeshModel.of(
            kind="single", omega=0.6, zeta=0.4, q0=0.2, eps1=0.3, chi1=0.9, chi2=0.7, z=1.4, damping_law=law)
        flow, w = flow_of(model)
        found[law] = flow.advance(w, 30, measured=True).measures[:, 0]
        assert found[law][Measure.BACK_TIME] == 0 and found[law][Measure.SWITCHES] > 30
    assert found["unilateral"][Measure.FORCE_MIN] > -1e-15 and found["contact"][Measure.FORCE_MIN] < -0.01


@pytest.mark.parametrize(("law", "seed"), daily(
    {"contact": (0, 1, 3, 6, 14), "unilateral": (1, 6, 12, 14)}, (0, 1, 3, 4, 6, 8, 12, 14)))
def test_volumes_shrink_while_contact_lasts(law, seed):
    model = random_model(law, seed)
    flow, w = flow_of(model)
    out = flow.advance(w, 3, tangent=unit(w), measured=True)
    if model.kind == "single":
        time = out.measures[[Measure.FRONT_TIME, Measure.BACK_TIME], 0].sum()
        rate = np.log(np.linalg.det(out.tangent[:, :, 0]))
        assert rate == pytest.approx(-2 * model.zeta * time * (1 / model.J1 + 1 / model.J2), abs=1e-10)
    long = flow.advance(w, 20, tangent=unit(w), growth=True, measured=True)
    duration = 20 * flow.system.period
    trace = mean_trace(flow.system, np.zeros(1, int), long.measures, duration)
    np.testing.assert_allclose(long.growth[:, :, 0].sum() / duration, trace, rtol=0, atol=1e-12)


STEP = 1e-3
SWITCHING = MeshModel.of(kind="single", omega=0.8, zeta=0.25, q0=0.02, eps1=0.1, theta1=0.4, contact_ratio=1.3)
LOWER, HIGHER = {"chi1": 0.8, "chi2": 0.6}, {"chi1": -0.5, "chi2": -0.8}
JUMPS = {
    "contact, which lasts": ("contact", LOWER, 0.8914181947277774, -1.8434712270705569),
    "contact, which lasts on a higher level": ("contact", HIGHER, 1.0959578269648906, -1.586531672454101),
    "pushing, which lasts": ("unilateral", LOWER, 1.5694311627422834, -1.917322660270795),
    "pushing, which lasts on a higher level": ("unilateral", HIGHER, 1.1246598298469939, 0.5236839780771607),
    "pushing, which ends": ("unilateral", LOWER, 0.9742444655216718, 0.20077138322111043),
    "a released flank": ("unilateral", HIGHER, 1.7083910556167288, -0.24510125476311617),
    "a released flank, which pushes": ("unilateral", HIGHER, 1.988662330602981, -0.18295055403288707)}
"""What a jump of the stiffness meets: law, levels and initial state."""


def derivative(model: MeshModel, name: str) -> np.ndarray:
    """Of z and z' after a mesh period by a parameter or an initial value, by the oracle."""
    value = model.initial[name] if name in model.initial else model.value(name)

    def advance(h: float) -> np.ndarray:
        end = scipy_oracle.section(model.with_values({name: value + h}), 1)
        return np.array([end["z"][0], end["z_dot"][0]])

    return central_difference(advance, STEP)


@pytest.mark.slow
@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("case", JUMPS)
def test_derivatives_by_parameters(case, side):
    law, levels, z, z_dot = JUMPS[case]
    model = replace(SWITCHING, damping_law=law).with_values(
        {"z": side * z, "z_dot": side * z_dot, "q0": side * 0.02, "eps1": side * 0.1, **levels})
    axes = ("contact_ratio", "zeta", "omega", "q0", "eps1", "chi1", "chi2")
    family = ParameterFamily(model, axes)
    values = family.start[None]
    out = family.flow(values).advance(family.initial_states(values))
    for name, found in zip((*axes, "z", "z_dot"), [*out.sensitivity[0].T, *out.monodromy[0].T], strict=True):
        np.testing.assert_allclose(found, derivative(model, name), rtol=1e-7, atol=1e-8, err_msg=name)
    flow, w = flow_of(model)
    np.testing.assert_allclose(flow.advance(w, 1, tangent=unit(w)).tangent[:, :, 0].T, out.monodromy[0], atol=1e-12)


@pytest.mark.parametrize("stiffness", [
    HarmonicStiffness((0.3, 0.1), (0.3, 1.0)), SteppedStiffness((0.6, 1.6, 0.9), (0.1, 0.4, 0.8))])
@pytest.mark.parametrize("law", ["contact", pytest.param("unilateral", marks=pytest.mark.exhaustive)])
def test_monodromy_of_the_full_model(law, stiffness):
    model = MeshModel(
        kind="full", omega=0.7, zeta=0.2, q1=0.05, q2=0.05, error=TransmissionError((0.2,)), stiffness=stiffness,
        damping_law=law, initial={"x1": 1.4, "x1_dot": -0.5, "y1": 0.05, "y1_dot": -0.1})
    flow, w = flow_of(model)
    out = flow.advance(w, 1, tangent=unit(w), measured=True)
    assert out.measures[Measure.SWITCHES, 0] > 0
    exact = central_difference(lambda h: flow.advance(w + h * np.eye(4), 1, points=np.zeros(4, int)).w, STEP)
    np.testing.assert_allclose(out.tangent[:, :, 0].T, exact, rtol=0, atol=1e-7)
    family = ParameterFamily(model, ())
    other = family.flow(family.start[None]).advance(w.T)
    np.testing.assert_allclose(other.monodromy[0], out.tangent[:, :, 0].T, rtol=0, atol=1e-12)


@pytest.mark.parametrize("zeta", [0.0, 1e-11])
def test_without_damping_the_laws_are_one(zeta):
    model = MeshModel.of(kind="single", omega=1.2, zeta=zeta, q0=0.1, eps1=0.1, z=1.3, damping_law="always")
    ends = []
    for law in ("always", *LAWS):
        flow, w = flow_of(replace(model, damping_law=law))
        out = flow.advance(w, 5, tangent=unit(w), measured=True)
        ends.append(np.concatenate([out.w.ravel(), out.tangent.ravel(), out.measures.ravel()]))
    for end in ends[1:]:
        np.testing.assert_allclose(end, ends[0], rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize("law", LAWS)
def test_reversed_time_leads_back(law):
    """Of random points, states and tangent vectors."""
    rng = np.random.default_rng(5)
    ranges = {"omega": (0.3, 3.0), "zeta": (0.0, 0.5), "eps1": (0.0, 0.3), "q0": (-0.1, 0.2), "chi1": (0, 0.5)}
    flow, _ = flow_of(MeshModel.of(damping_law=law), {name: rng.uniform(*ends, 60) for name, ends in ranges.items()})
    w, points = np.stack([rng.uniform(-1.8, 1.8, 300), rng.uniform(-1, 1, 300)]), rng.integers(0, 60, 300)
    signs = velocity_signs(flow.system.names)[:, None]
    there = flow.advance(w, 1, points=points, tangent=unit(w))
    back = ExactFlow(reversed_in_time(flow.system)).advance(signs * there.w, 1, points=points, tangent=unit(w))
    assert np.all(there.status == OK) and np.all(back.status == OK)
    error = np.abs(signs * back.w - w).max(axis=0) / np.abs(back.tangent).max(axis=(0, 1))
    assert error.max() < 1e-12
    turned = np.einsum("ji,kiL,i->kjL", np.diag(signs[:, 0]), there.tangent, np.ones(2))
    product = np.einsum("jiL,kjL,i->kiL", back.tangent, turned, signs[:, 0])
    typical = np.abs(product - unit(w)).max(axis=(0, 1))
    assert np.median(typical) < 1e-10


