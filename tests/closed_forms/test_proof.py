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


def response(model, eps, time=0):
    """z and z' of the steady motion in permanent contact at the front flank, χ = 1 and one harmonic, at τ = time T."""
    torque = (model.q1 + model.q2) / model.J1
    omega, zeta, q0, eps = (ball(Fraction(v)) if not isinstance(v, arb) else v for v in (
        model.omega, model.zeta, torque, eps))
    real, imaginary = 1 - omega**2, 2 * zeta * omega
    size = eps * omega**2 / (real**2 + imaginary**2)
    sine, cosine = (2 * ball(Fraction(time))).sin_cos_pi()
    return [1 + q0 + size * (real * cosine + imaginary * sine), size * omega * (imaginary * cosine - real * sine)]


def point(model, eps, time=0):
    """The nearest floats, [z, z']."""
    with precision(BITS):
        return [float(v) for v in response(model, eps, time)]


def assert_precise(matrix):
    assert max(float(entry.rad()) for entry in matrix.entries()) < 1e-30


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
    result = prove_orbit(model, np.array([point(model, 0.125, phase)]), phase=phase)
    assert isinstance(result, Certificate)
    assert (result.inside, result.outside, result.document["switches"]) == (2, 0, [[]])
    with precision(BITS):
        exact = response(model, 0.125, phase)
        for value, text in zip(exact, result.document["points"][0], strict=True):
            assert abs(value - float.fromhex(text)) < result.radius
        motion = trajectory(equations(model, phase), arb_mat(2, 1, exact))
        for image, value in zip(motion.image.entries(), exact, strict=True):
            assert image.overlaps(value) and abs(image - value) < 1e-30


@pytest.mark.parametrize("waveform", [
    {"chi1": 0.25, "chi2": 0.25, "contact_ratio": 1.625}, {"stiffness": SteppedStiffness((1.25, 0.75), (0.0, 0.625))},
    {"chi1": 0.0, "chi2": 0.0}])
def test_the_derivative_in_permanent_contact_is_that_of_meissners_equation(waveform):
    """Under two levels, or one."""
    model = MeshModel.of(kind="single", omega=1.2, zeta=0.02, q0=0.4, eps1=0.01, **waveform)
    with precision(BITS):
        mesh = equations(model)
        zeta = ball(Fraction(model.zeta))
        first, second = (oscillator(arb(level if waveform.get("chi1") != 0 else 1), zeta, mesh.duration * share)
                         for level, share in ((1.25, 0.625), (0.75, 0.375)))
        tube = StartTube(mesh, column([1.4, 0.0], 1e-6))
        assert tube.slopes.overlaps(second * first)
        assert tube.slopes.det().overlaps((-2 * zeta * mesh.duration).exp())
        assert_precise(tube.slopes)
    assert tube.windows == []


def test_free_flight():
    """Without torque and stiffness in play, z'' + 2ζz' = -ε''."""
    model = MeshModel.of(kind="single", omega=2.0, zeta=0.05, q0=0.0, eps1=0.125, theta1=0.5)
    with precision(BITS):
        mesh = equations(model)
        omega, rate, theta = (ball(Fraction(v)) for v in (model.omega, 2 * model.zeta, 0.5))
        size = ball(Fraction(0.125)) * omega / (omega**2 + rate**2)

        def forced(tau):
            sine, cosine = (omega * tau - theta).sin_cos()
            return arb_mat([[size * (rate * sine - omega * cosine)], [size * omega * (rate * cosine + omega * sine)]])

        start = arb_mat([[-0.5], [0.25]]) - forced(arb(0))
        decay = (-rate * mesh.duration).exp()
        expected = arb_mat([[1, (1 - decay) / rate], [0, decay]]) * start + forced(mesh.duration)
        image = trajectory(mesh, column([-0.5, 0.25])).image
        assert image.overlaps(expected)
        assert_precise(image)


def test_fourier_series_of_constant_stiffness():
    """A Fourier stiffness whose harmonics are too small to matter gives the flow of constant stiffness."""
    constant = MeshModel.of(**LINEAR, eps1=0.125, eps3=0.01, theta3=1.0)
    fourier = constant.with_values({"stiffness": HarmonicStiffness((0.0, 1e-60))})
    with precision(BITS):
        images = [trajectory(equations(m), column([1.5, 0.25])).image for m in (constant, fourier)]
        assert images[0].overlaps(images[1] + column([0, 0], 1e-50))
        for image in images:
            assert_precise(image)


@pytest.mark.parametrize("gap", [1e-6, 1e-12, 1e-15])
def test_grazing_pair(gap):
    """Next to a graze the orbits on both sides are proved: with no switch, and with two."""
    model = MeshModel.of(**LINEAR)
    for sign, switches in ((1, 0), (-1, 2)):
        with precision(BITS):
            eps = float(grazing_amplitude(model, ball(Fraction(sign * gap))))
        result = prove_orbit(model.with_values({"eps1": eps}), np.array([point(model, eps)]))
        assert isinstance(result, Certificate) and result.radius < 10 * gap
        assert len(result.document["switches"][0]) == switches


def test_graze_is_undecided():
    """A box with motions that graze from both sides is not proved, however the check is done."""
    model = MeshModel.of(**LINEAR)
    with precision(BITS):
        eps = float(grazing_amplitude(model, arb(0)))
        mesh = equations(model.with_values({"eps1": eps}))
        for radius in (1e-3, 1e-6, 1e-9):
            with pytest.raises(UndecidedError) as failure:
                StartTube(mesh, column(point(model, eps), radius))
            assert failure.value.reason == "tangency undecided"


DRIVEN, UNDAMPED = MeshModel.of(**LINEAR, eps1=0.125), MeshModel.of(**LINEAR | {"zeta": 0.0}, eps1=0.0625)


@pytest.mark.parametrize(("model", "points", "reason"), [
    (UNDAMPED, [point(UNDAMPED, 0.0625)], "neutral"),
    (DRIVEN, [point(DRIVEN, 0.125)] * 2, "period not minimal"),  # a 1T orbit given twice
    (DRIVEN, [[1.75, 0.5]], "Newton diverged")])
def test_what_is_no_stable_orbit_of_its_period_is_not_proved(model, points, reason):
    result = prove_orbit(model, np.array(points))
    assert isinstance(result, Unproved) and result.reason == reason
