"""The switched affine system against the equations of the paper, written out in their own coordinates."""

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.model import MeshModel, mesh_stiffness, transmission_error, vary
from gearchaos.model.coordinates import from_physical
from gearchaos.model.switched import coordinates, equal_ratios, switched_system
from tests.oracles import scipy_oracle
from tests.oracles.march import NAMES

UNEQUAL = {"J1": 1.7, "J2": 3.1, "q1": 0.3, "q2": 0.2, "zeta": 0.03, "eps1": 0.07, "theta1": 0.4, "eps2": 0.02}
SUPPORTS = {"mu1": 3.0, "mu2": 5.0, "kappa1": 0.7, "kappa2": 1.9, "zeta_support1": 0.02, "zeta_support2": 0.05}
KINDS = {
    "single": {"kind": "single", **UNEQUAL},
    "beta/J alike": {"kind": "torsional", **UNEQUAL, "beta1": 0.017, "beta2": 0.031},
    "beta/J unlike": {"kind": "torsional", **UNEQUAL, "beta1": 0.02, "beta2": 0.07},
    "supports alike": {"kind": "full", "mu1": 3.0, "mu2": 6.0, "kappa1": 0.5, "kappa2": 1.0, "eps1": 0.05, "J": 1.4},
    "supports alike, beta/J unlike": {"kind": "full", "beta1": 0.05, "J2": 4.0, "q1": 0.4, "eps1": 0.05},
    "all unequal": {"kind": "full", **UNEQUAL, **SUPPORTS, "beta1": 0.02, "beta2": 0.07}}
TURNING = [*list(KINDS)[:-1], pytest.param("all unequal", marks=pytest.mark.exhaustive)]  # kernels of eight coordinates


def model_of(name, **values):
    return MeshModel.of(omega=1.3, **{**KINDS[name], **values})


def error_at(model, tau):
    return (transmission_error(model, np.array([tau]), derivative) for derivative in (0, 1, 2))


def rates(model, names, state, tau, contact):
    """w' of physical states (n, L) by (2.12) or (2.17): w is linear in x and y, but for the transmission error."""
    level = mesh_stiffness(model, tau)
    plain = MeshModel(**{**model.__dict__, "stiffness": type(model.stiffness)()})
    right = scipy_oracle._right_side(plain, contact, level)
    slopes = np.stack([right(tau, lane) for lane in state.T], axis=1)
    if model.kind == "single":
        return slopes
    _, error_dot, error_ddot = error_at(model, tau)
    by_name = dict(zip(NAMES[model.kind], slopes, strict=True))
    return from_physical(names, with_lateral(by_name), error_dot, error_ddot).T


def with_lateral(values):
    zero = np.zeros_like(values["x1"])
    return {**dict.fromkeys(("y1", "y1_dot", "y2", "y2_dot"), zero), **values}


def states_of(model, names, rng, tau, contact):
    """Random physical states (n, L) in a contact state, and the same in the coordinates of the system."""
    z = {-1: -1 - rng.random(6), 0: rng.uniform(-1, 1, 6), 1: 1 + rng.random(6)}[contact]
    physical = rng.normal(size=(len(NAMES[model.kind]), 6))
    if model.kind == "single":
        physical[0] = z
        return physical, physical
    error, error_dot, _ = error_at(model, tau)
    by_name = with_lateral(dict(zip(NAMES[model.kind], physical, strict=True)))
    by_name["x1"][:] = z + by_name["x2"] - by_name["y1"] + by_name["y2"] + error
    return physical, from_physical(names, by_name, error, error_dot).T


@pytest.mark.parametrize("contact", [-1, 0, 1])
@pytest.mark.parametrize("name", KINDS)
def test_the_system_is_the_equations_of_the_paper(name, contact):
    """w' = A w + f(τ) − b χ(τ)(w[0] − σ), in the middle of either stiffness level."""
    model, rng = model_of(name, chi1=0.3, chi2=0.2, contact_ratio=1.4), np.random.default_rng(contact + 1)
    system = switched_system(vary(model, {}))
    for share, level in ((0.2, 0), (0.7, 1)):
        tau = share * model.period
        physical, w = states_of(model, system.names, rng, tau, contact)
        forcing = system.f0[0].copy()
        phase = np.arange(1, system.f_cos.shape[1] + 1) * model.omega * tau
        forcing[1] += system.f_cos[0] @ np.cos(phase) + system.f_sin[0] @ np.sin(phase)
        found = system.A[0] @ w + forcing[:, None]
        found -= np.outer(system.b[0], system.levels[0, level] * (w[0] - contact) * (contact != 0))
        np.testing.assert_allclose(found, rates(model, system.names, physical, tau, contact), atol=1e-13)
    assert (*system.starts[0], system.damping[0]) == (0, pytest.approx(0.4), 2 * model.zeta)


def steady_waves(name, **values):
    """A steady motion in permanent contact, so that it is smooth and its samples average to rounding."""
    model = model_of(name, chi0=0.0, q1=0.9, q2=0.6, **values)
    return model, gc.simulate(model, 1, transient=4000, samples=64)


@pytest.mark.parametrize("name", TURNING[1:])
def test_the_static_force_is_the_mean_one_of_a_steady_motion(name):
    model, motion = steady_waves(name)
    assert np.all(motion.contact == 1)
    static = switched_system(vary(model, {})).static_force[0, 0]
    assert float(motion.mesh_force.mean()) == pytest.approx(static, rel=1e-9)
    both = model.beta1 + model.beta2  # the torques balance: q1 − 2β1 v = S = q2 + 2β2 v at one mean speed v
    assert static == pytest.approx((model.q1 * model.beta2 + model.q2 * model.beta1) / both, rel=1e-14)


def test_without_friction_the_static_force_is_what_speeds_both_wheels_up_alike():
    """(q1 − S)/J1 = (S − q2)/J2."""
    model, motion = steady_waves("beta/J alike", beta=0.0)
    static = switched_system(vary(model, {})).static_force[0, 0]
    assert float(motion.mesh_force.mean()) == pytest.approx(static, rel=1e-9)
    assert (model.q1 - static) / model.J1 == pytest.approx((static - model.q2) / model.J2, rel=1e-12)


@pytest.mark.parametrize("name", TURNING)
def test_the_rms_velocity_is_that_of_the_first_wheel(name):
    model, motion = steady_waves(name)
    velocity = motion.z_dot if name == "single" else motion.x1_dot
    assert gc.regime(model).v_rms == pytest.approx(float(np.sqrt((velocity**2).mean())), rel=1e-9)


def test_the_mean_speed_is_that_at_which_friction_takes_the_spare_torque():
    model, motion = steady_waves("beta/J alike")
    mean = (model.q1 - model.q2) / (2 * (model.beta1 + model.beta2))
    assert switched_system(vary(model, {})).velocity0[0] == pytest.approx(mean, rel=1e-14)
    assert float(motion.x1_dot.mean()) == pytest.approx(mean, rel=1e-9)
    assert switched_system(vary(model_of("beta/J alike", beta=0.0), {})).velocity0[0] == 0  # there is none


def test_ratios_are_the_same_to_rounding_and_no_further():
    """β1/J1 = β2/J2 decides whether z feels the mean rotation; 1e-12 of it is felt."""
    factors, model = np.random.default_rng(0).uniform(0.1, 10, 1000), MeshModel.of(J1=2.0, beta1=0.01)

    def alike(off):
        return equal_ratios(vary(model, {"beta2": 0.01 * factors * (1 + off), "J2": 2.0 * factors}), "beta", "J")

    assert np.all(alike(0.0))
    for off in (1e-12, 1e-6):
        assert not np.any(alike(off))
        assert coordinates(vary(model.with_values({"beta2": 0.01 * (1 + off)}), {})) == ("z", "z_dot", "x2_dot")


def test_points_are_taken_in_order():
    system = switched_system(vary(MeshModel.of(), {"omega": [1.0, 2.0, 3.0]}))
    part = system.take(np.array([2, 0]))
    assert part.points == 2 and part.names == system.names
    np.testing.assert_array_equal(part.period, 2 * np.pi / np.array([3.0, 1.0]))
    np.testing.assert_array_equal(part.A, system.A[[2, 0]])


@pytest.mark.parametrize("zeta", [0.5, np.nextafter(0.5, 1), 0.5 + 1e-14])
def test_nearly_critical_supports_move_as_critical_ones(zeta):
    """κ/μ = 1/4: the mean lateral motion is e^−τ/2 (m + (m' + m/2) τ), but for the square of the tiny difference."""
    model = MeshModel.of(kind="full", kappa=1.0, mu=4.0, zeta_support=float(zeta), y1=0.5, y2=0.1, y2_dot=0.2)
    data = gc.simulate(model, 4)
    tau, mean, mean_dot = data.tau_section.values, 0.3, 0.1
    expected = np.exp(-tau / 2) * (mean + (mean_dot + mean / 2) * tau)
    np.testing.assert_allclose((data.section_y1 + data.section_y2) / 2, expected, atol=1e-11)
