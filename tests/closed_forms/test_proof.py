"""Proofs in ball arithmetic where the motion is known in closed form: permanent contact and free flight."""

from fractions import Fraction

import numpy as np
import pytest
from flint import arb, arb_mat

from gearchaos.model import HarmonicStiffness, MeshModel, SteppedStiffness
from gearchaos.proof.balls import ball, precision
from gearchaos.proof.certificate import Certificate, UndecidedError, Unproved
from gearchaos.proof.equations import MeshEquations
from gearchaos.proof.motion import trajectory
from gearchaos.proof.parameters import exact_parameters
from gearchaos.proof.prove import prove_orbit
from gearchaos.proof.tube import StartTube

BITS = 128
LINEAR = {"kind": "single", "omega": 1.75, "zeta": 0.0625, "q0": 0.25, "chi1": 0.0, "chi2": 0.0}


def equations(model, phase=0.0, bits=BITS):
    return MeshEquations(exact_parameters(model), Fraction(phase), bits)


def column(values, radius=0):
    return arb_mat(len(values), 1, [arb(v, radius) for v in values])


def response(model, eps, time):
    """z and z' of the steady motion in permanent contact at the front flank, χ = 1 and one harmonic, at τ = time T."""
    torque = (model.q1 + model.q2) / model.J1
    omega, zeta, q0 = (ball(Fraction(v)) for v in (model.omega, model.zeta, torque))
    real, imaginary = 1 - omega**2, 2 * zeta * omega
    size = eps * omega**2 / (real**2 + imaginary**2)
    sine, cosine = (2 * ball(Fraction(time))).sin_cos_pi()
    return [1 + q0 + size * (real * cosine + imaginary * sine),
            size * omega * (imaginary * cosine - real * sine)]


def grazing_amplitude(model, gap):
    """The amplitude ε with which the least z in permanent contact is 1 + gap."""
    omega, zeta = ball(Fraction(model.omega)), ball(Fraction(model.zeta))
    q0 = ball(Fraction((model.q1 + model.q2) / model.J1))
    return (q0 - gap) * ((1 - omega**2) ** 2 + (2 * zeta * omega) ** 2).sqrt() / omega**2


def oscillator(stiffness, zeta, duration):
    """exp of the matrix of x'' + 2ζx' + stiffness x = 0 over a duration, (2, 2)."""
    rate = (stiffness - zeta**2).sqrt()
    decay, (sine, cosine) = (-zeta * duration).exp(), (rate * duration).sin_cos()
    return arb_mat([[cosine + zeta * sine / rate, sine / rate],
                    [-stiffness * sine / rate, cosine - zeta * sine / rate]]) * decay


@pytest.mark.parametrize("phase", [0.0, 0.3125])
def test_steady_linear_response(phase):
    model = MeshModel.of(**LINEAR, eps1=0.125)
    with precision(BITS):
        exact = response(model, ball(Fraction(0.125)), phase)
        points = np.array([[float(v) for v in exact]])
    result = prove_orbit(model, points, phase=phase)
    assert isinstance(result, Certificate)
    assert (result.inside, result.outside, result.document["switches"]) == (2, 0, [[]])
    with precision(BITS):
        for value, text in zip(exact, result.document["points"][0], strict=True):
            assert abs(value - float.fromhex(text)) < result.radius
        motion = trajectory(equations(model, phase), arb_mat(2, 1, exact))
        for image, value in zip(motion.image.entries(), exact, strict=True):
            assert image.overlaps(value) and abs(image - value) < 1e-30


def test_derivative_in_permanent_contact():
    model = MeshModel.of(**LINEAR, eps1=0.125)
    with precision(BITS):
        mesh = equations(model)
        expected = oscillator(arb(1), ball(Fraction(model.zeta)), mesh.duration)
        start = [float(v) for v in response(model, ball(Fraction(0.125)), 0)]
        tube = StartTube(mesh, column(start, 1e-3))
        assert tube.slopes.overlaps(expected)
        assert max(float(e.rad()) for e in tube.slopes.entries()) < 1e-30
    assert tube.windows == []


def test_meissner_multipliers():
    """In permanent contact under two levels the derivative is that of Meissner's equation."""
    model = MeshModel.of(kind="single", omega=1.2, zeta=0.02, q0=0.4, chi1=0.25, chi2=0.25, contact_ratio=1.625,
                         eps1=0.01)
    with precision(BITS):
        mesh = equations(model)
        zeta = ball(Fraction(model.zeta))
        first, second = (oscillator(arb(level), zeta, mesh.duration * share)
                         for level, share in ((1.25, 0.625), (0.75, 0.375)))
        tube = StartTube(mesh, column([1.4, 0.0], 1e-6))
        expected = second * first
        assert tube.slopes.overlaps(expected)
        assert tube.slopes.det().overlaps((-2 * zeta * mesh.duration).exp())
        assert max(float(v.rad()) for v in tube.slopes.entries()) < 1e-30
        steps = model.with_values({"stiffness": SteppedStiffness((1.25, 0.75), (0.0, 0.625))})
        assert StartTube(equations(steps), column([1.4, 0.0], 1e-6)).slopes.overlaps(expected)


def test_free_flight():
    """Without torque and stiffness in play, z'' + 2ζz' = -ε''."""
    model = MeshModel.of(kind="single", omega=2.0, zeta=0.05, q0=0.0, eps1=0.125, theta1=0.5)
    with precision(BITS):
        mesh = equations(model)
        omega, rate, theta = (ball(Fraction(v)) for v in (model.omega, 2 * model.zeta, 0.5))
        size = ball(Fraction(0.125)) * omega / (omega**2 + rate**2)

        def forced(tau):
            sine, cosine = (omega * tau - theta).sin_cos()
            return arb_mat([[size * (rate * sine - omega * cosine)],
                            [size * omega * (rate * cosine + omega * sine)]])

        start = arb_mat([[-0.5], [0.25]]) - forced(arb(0))
        decay = (-rate * mesh.duration).exp()
        flow = arb_mat([[1, (1 - decay) / rate], [0, decay]])
        expected = flow * start + forced(mesh.duration)
        image = trajectory(mesh, column([-0.5, 0.25])).image
        assert image.overlaps(expected)
        assert max(float(v.rad()) for v in image.entries()) < 1e-30


def test_fourier_series_of_constant_stiffness():
    """A Fourier stiffness whose harmonics are too small to matter gives the flow of constant stiffness."""
    constant = MeshModel.of(**LINEAR, eps1=0.125, eps3=0.01, theta3=1.0)
    fourier = constant.with_values({"stiffness": HarmonicStiffness((0.0, 1e-60))})
    with precision(BITS):
        images = [trajectory(equations(m), column([1.5, 0.25])).image for m in (constant, fourier)]
        assert images[0].overlaps(images[1] + column([0, 0], 1e-50))
        assert max(float(v.rad()) for image in images for v in image.entries()) < 1e-30


@pytest.mark.parametrize("gap", [1e-6, 1e-12, 1e-15])
def test_grazing_pair(gap):
    """Next to a graze the orbits on both sides are proved: with no switch, and with two."""
    model = MeshModel.of(**LINEAR)
    for sign, switches in ((1, 0), (-1, 2)):
        with precision(BITS):
            eps = float(grazing_amplitude(model, ball(Fraction(sign * gap))))
            points = np.array([[float(v) for v in response(model, ball(Fraction(eps)), 0)]])
        result = prove_orbit(model.with_values({"eps1": eps}), points)
        assert isinstance(result, Certificate)
        assert len(result.document["switches"][0]) == switches
        assert result.radius < 10 * gap


def test_graze_is_undecided():
    """A box with motions that graze from both sides is not proved, however the check is done."""
    model = MeshModel.of(**LINEAR)
    with precision(BITS):
        eps = float(grazing_amplitude(model, arb(0)))
        mesh = equations(model.with_values({"eps1": eps}))
        points = [float(v) for v in response(model, ball(Fraction(eps)), 0)]
        for radius in (1e-3, 1e-6, 1e-9):
            with pytest.raises(UndecidedError) as failure:
                StartTube(mesh, column(points, radius))
            assert failure.value.reason == "tangency undecided"


def test_undamped_linear_response_is_neutral():
    model = MeshModel.of(**LINEAR | {"zeta": 0.0}, eps1=0.0625)
    with precision(BITS):
        points = np.array([[float(v) for v in response(model, ball(Fraction(0.0625)), 0)]])
    result = prove_orbit(model, points)
    assert isinstance(result, Unproved)
    assert result.reason == "neutral"


def test_period_claimed_too_long():
    """The points of a 1T orbit given twice are no orbit of minimal period 2."""
    model = MeshModel.of(**LINEAR, eps1=0.125)
    with precision(BITS):
        point = [float(v) for v in response(model, ball(Fraction(0.125)), 0)]
    result = prove_orbit(model, np.array([point, point]))
    assert isinstance(result, Unproved)
    assert result.reason == "period not minimal"


def test_points_that_are_no_orbit():
    model = MeshModel.of(**LINEAR, eps1=0.125)
    result = prove_orbit(model, np.array([[1.75, 0.5]]))
    assert isinstance(result, Unproved)
    assert result.reason == "Newton diverged"
