"""Order spectra: signals and linear motions in closed form, integrals of the flow, names of lines, bad input."""

import tomllib
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy.linalg import expm

import gearchaos as gc
from gearchaos.dynamics import classify
from gearchaos.dynamics.settings import SINGLE_MOTION
from gearchaos.dynamics.time_series import line_amplitudes, modulation, real_cepstrum
from gearchaos.flow import ExactFlow
from gearchaos.gears.operation.operating import as_model, model_of_gears
from gearchaos.studies.core.initial_value_problems import initial_value_problems
from gearchaos.studies.motion.simulate import mesh_forces
from gearchaos.studies.vibration.orders import Wheels, force_by_motion
from tests.closed_forms.linear_gears import LINEAR, PAIR
from tests.commands import ask, run_json

TEETH, DEPTH = 25, 0.3
ANGLE = 2 * np.pi * np.arange(2 * TEETH * 64) / (TEETH * 64)  # two turns
TRAIN_FILE = """
[train]
speed = "3000 rpm"
[[train.bodies]]
name = "pinion"
inertia = "4.88e-4 kg*m^2"
torque = "85 N*m"
torque_orders = [{ order = 1, amplitude = "8 N*m" }]
[[train.bodies]]
name = "wheel"
inertia = "3.2e-3 kg*m^2"
torque = "-136 N*m"
[[train.meshes]]
name = "z1/z2"
between = ["pinion", "wheel"]
teeth = [25, 40]
base_radii = ["35.24 mm", "56.384 mm"]
stiffness = { levels = ["4.5e8 N/m", "3e8 N/m"], starts = [0, 0.6] }
damping = "2000 N*s/m"
backlash = "0.12 mm"
error_amplitudes = ["2 um"]
"""
TRAIN = gc.Train(**tomllib.loads(TRAIN_FILE)["train"])
LINEAR_TRAIN = replace(TRAIN, speed=4000.0, bodies=[replace(TRAIN.bodies[0], torque_orders=()), TRAIN.bodies[1]],
                       meshes=[replace(TRAIN.meshes[0], stiffness=4e8, error_amplitudes=[2e-7])])


def ordered(order=None):
    """The train with its pinion's torque of this order, or a steady one."""
    orders = [{"order": order, "amplitude": 8.0}] if order else []
    return replace(TRAIN, bodies=[replace(TRAIN.bodies[0], torque_orders=orders), TRAIN.bodies[1]])


def pair(**values):
    """Little damped, and of two levels of the stiffness."""
    return gc.GearPair(**{**PAIR, "k": 530.0, **values})


def test_a_modulated_signal_has_its_sidebands_its_modulation_and_all_its_power():
    """5 (1 + m cos Ωt) cos zΩt has lines 5 at z and 5 m/2 at z ± 1."""
    signal = 2.0 + 5 * (1 + DEPTH * np.cos(ANGLE)) * np.cos(TEETH * ANGLE)
    lines = line_amplitudes(signal, len(signal), True)
    expected = np.zeros(len(lines))
    expected[[0, 2 * TEETH - 2, 2 * TEETH, 2 * TEETH + 2]] = 2.0, 2.5 * DEPTH, 5.0, 2.5 * DEPTH
    np.testing.assert_allclose(lines, expected, atol=1e-13)
    envelope = modulation(signal, 1, 2 * TEETH, TEETH, True)
    np.testing.assert_allclose(envelope, np.where(np.arange(1, TEETH) == 2, DEPTH, 0.0), atol=1e-13)
    noise = np.random.default_rng(1).normal(1.0, 1.0, 4096)
    own = line_amplitudes(noise, 4096, True)
    assert own[0] ** 2 + (own[1:] ** 2).sum() / 2 == pytest.approx((noise**2).mean(), rel=1e-13)


def test_the_lines_of_hann_windows_have_the_amplitude_of_a_sine_and_the_mean_is_in_none_of_them():
    signal = np.tile(5.0 + 3.0 * np.cos(TEETH * ANGLE), 4)
    lines = line_amplitudes(signal, len(ANGLE), False)
    np.testing.assert_allclose(lines[[0, 1, 2 * TEETH]], [5.0, 0.0, 3.0], atol=1e-12)


def test_an_echo_is_seen_in_the_cepstrum():
    """x(t) + a x(t − T) has the cepstrum a/2 at T and −a²/4 at 2T."""
    signal = np.zeros(1024)
    signal[[0, 100]] = 1.0, 0.2
    found = real_cepstrum(np.abs(np.fft.rfft(signal)), 1e-9)
    np.testing.assert_allclose(found[[100, 200, 150]], [0.1, -0.01, 0.0], atol=1e-5)


WHEELS = Wheels({"mesh": Fraction(25)}, {Fraction(1): "wheel 1", Fraction(5, 8): "wheel 2"},
                {Fraction(6): "order 6 of engine"}, Fraction(5, 8))


@pytest.mark.parametrize(("order", "name", "carrier"), [
    (Fraction(50), "mesh 2", None), (Fraction(25, 2), "1/2 mesh", None), (Fraction(6), "order 6 of engine", None),
    (Fraction(24), "mesh 1 - 1 turn of wheel 1", 25), (Fraction(53), "mesh 2 + 3 turns of wheel 1", 50),
    (Fraction(205, 8), "mesh 1 + 1 turn of wheel 2", 25), (Fraction(30), "mesh 1 + 5 turns of wheel 1", 25),
    (Fraction(49, 2), "mesh 1 - 1/2 turn of wheel 1", 25), (Fraction(15, 8), "turn 3 of wheel 2", None),
    (Fraction(1, 3), "order 0.333333", None)])
def test_names_of_lines(order, name, carrier):
    assert WHEELS.name(order, 2) == (name, carrier)


def test_names_in_a_band_and_of_several_meshes():
    """A band has lines everywhere, of which only multiples of the order of the common period are told apart."""
    assert [WHEELS.name(order, 0)[0] for order in (Fraction(205, 8), Fraction(24))] == [
        "mesh 1 + 1 turn of wheel 2", "order 24"]
    wheels = Wheels({"a": Fraction(20), "b": Fraction(9)}, {Fraction(1): "x"}, {}, Fraction(1))
    assert [wheels.name(Fraction(order), 1)[0] for order in (40, 27, 19)] == [
        "mesh 2 of a", "mesh 3 of b", "mesh 1 of a - 1 turn of x"]


@pytest.mark.parametrize("gears", [LINEAR, LINEAR_TRAIN], ids=["pair", "train"])
@pytest.mark.parametrize(("quantity", "name"), [
    ("mesh force", "force"), ("deflection", "deflection"), ("transmission error", "transmission_error"),
    ("acceleration", "acceleration")])
def test_the_lines_of_linear_gears_follow_their_transfer_function(gears, quantity, name):
    """m s'' + k s' + c s = M/R + m e₁ w² cos wt, in SI; the transmission error is s + e₁ cos wt."""
    found = gc.physical(gc.orders(gears, quantity=quantity))[f"order_{name}"]
    w, mass = 2 * np.pi * 25 * 4000 / 60, 1 / (0.03524**2 / 4.88e-4 + 0.056384**2 / 3.2e-3)
    below = 4e8 - mass * w**2 + 1j * 2000 * w
    deflection, total = mass * 2e-7 * w**2 / abs(below), 2e-7 * abs((4e8 + 1j * 2000 * w) / below)
    static = 85 / 0.03524
    first, mean = {"mesh force": (abs(4e8 + 1j * 2000 * w) * deflection, static), "acceleration": (w**2 * total, 0.0),
                   "deflection": (1e6 * deflection, 1e6 * static / 4e8),
                   "transmission error": (1e6 * total, 1e6 * static / 4e8)}[quantity]
    np.testing.assert_allclose(found.sel(order=[0, 25]), [mean, first], rtol=1e-9)
    assert float(found.drop_sel(order=[0, 25]).max()) < 1e-7 * first


def test_the_lines_of_a_linear_train_under_a_torque_order_follow_its_transfer_function():
    """The deflection of two wheels under the torque M₁ cos Ωt of the first: s (c − m w² + i k w) = m M₁ R₁/I₁."""
    radius, inertia, order = 0.05, 1e-3, 3
    bodies = [gc.Body(name=name, inertia=inertia, torque=sign * 50.0, torque_orders=[
        {"order": order, "amplitude": 4.0}] if sign > 0 else []) for name, sign in (("a", 1), ("b", -1))]
    mesh = gc.Mesh(between=("a", "b"), teeth=(50, 50), base_radii=(radius, radius), stiffness=1e8, damping=3000.0,
                   backlash=1e-4)
    train = gc.Train(speed=6000.0, bodies=bodies, meshes=[mesh])
    found = gc.physical(gc.orders(train))
    assert not found.modulation.any()  # nor is there a line of the mesh
    mass, w = inertia / radius**2 / 2, 2 * np.pi * order * 100
    force = abs((1e8 + 3000j * w) * mass * 4.0 * radius / inertia / (1e8 - mass * w**2 + 3000j * w))
    np.testing.assert_allclose(found.order_force.sel(order=[0, order]), [1000.0, force], rtol=1e-9)
    assert found.line.sel(order=order) == "order 3 of a"
    deflection = gc.physical(gc.orders(train, quantity="deflection")).order_deflection
    np.testing.assert_allclose(deflection.sel(order=0), 10.0, rtol=1e-9)  # µm, by 1000 N


def test_the_power_of_all_lines_is_that_of_the_integrals_of_the_flow():
    """The flow integrates the deflection and its square exactly, without samples."""
    gears = pair(error_amplitudes=[6e-6], speed=14000.0)
    verdict = gc.regime(gears)
    found = gc.orders(gears, quantity="deflection")
    assert verdict.label == found.attrs["motion"] and verdict.contact != "permanent"
    assert np.sqrt((found.order_deflection[1:] ** 2).sum() / 2) == pytest.approx(verdict.z_rms, rel=1e-6)
    rms = gc.orders(gears, quantity="deflection", rms=True).order_deflection
    np.testing.assert_allclose(rms[1:], found.order_deflection[1:] / np.sqrt(2))


@pytest.mark.slow
def test_a_torque_once_per_turn_shows_as_sidebands_that_steady_gears_lack():
    found = gc.physical(gc.orders(ordered(1), against=ordered()))
    line = found.order_force.sel
    assert found.attrs["carrier"] == 125 and found.line.sel(order=124) == "mesh 5 - 1 turn of pinion"
    assert float(found.sideband_ratio.sel(order=124)) == pytest.approx(float(line(order=124) / line(order=125)))
    assert found.modulation.idxmax() == 1
    steady = found.against_order_force
    assert float(steady.sel(order=124)) < 1e-9 * float(steady.sel(order=125))
    np.testing.assert_allclose(steady.sel(order=125), line(order=125), rtol=1e-3)
    alone = gc.physical(gc.orders(ordered())).order_force
    np.testing.assert_allclose(steady.sel(order=alone.order), alone, atol=1e-6)
    figure = gc.plot.orders(found, Figure())
    assert {"mesh 5", "- 1 turn of pinion"} <= {text.get_text() for ax in figure.axes for text in ax.texts}
    # once per turn of the wheel, in windows of 16 turns of the pinion
    slow = gc.physical(gc.orders(ordered(0.625), against=ordered(), samples=16))
    alone = gc.physical(gc.orders(ordered(), samples=16)).order_force
    assert slow.line.sel(order=125.625) == "mesh 5 + 1 turn of wheel"
    np.testing.assert_allclose(slow.against_order_force.sel(order=alone.order), alone, atol=1e-6)


def test_a_motion_of_doubled_period_has_half_harmonics_and_a_chaotic_one_a_band():
    doubled = gc.orders(pair(speed=20000.0, error_amplitudes=[2e-5]))
    assert doubled.attrs["motion"] == "2T" and doubled.line.sel(order=12.5) == "1/2 mesh"
    third = gc.orders(pair(speed=9750.0, error_amplitudes=[6e-6]))
    assert third.attrs["motion"] == "3T" and third.line.str.contains("/3 mesh").any()  # in windows of six turns
    assert not third.line.str.startswith("order").any()
    gears = pair(speed=12000.0, error_amplitudes=[2e-5])
    chaotic = gc.orders(gears)
    assert gc.regime(gears).label == chaotic.attrs["motion"] == "chaotic" and "Hann" in chaotic.attrs["window"]
    power = float((chaotic.order_force[1:] ** 2).sum() / 2) / 1.5  # a line of a Hann window is 1.5 lines wide
    assert np.diff(np.flatnonzero(chaotic.line.str.startswith("order"))).min() > 1  # of a peak the highest line alone
    signal = gc.simulate(gears, 2000, 500, samples=64).mesh_force
    assert power == pytest.approx(float(signal.var()), rel=0.2)


def test_a_motion_without_bound_has_no_lines():
    found = gc.orders(pair(k=0.0, speed=28740.0, chi1=0.9, chi2=0.9))  # parametric resonance
    assert found.attrs["status"] == "diverged" and found.order_force.isnull().all() and not (found.line != "").any()
    gc.plot.orders(found, Figure())


def jumping_lines(model, highest):
    """The lines 0, 1, … of the force S = 2ζ z' + χ (z − 1) where z'' + S = q + ε ω² cos ωτ in contact, and χ is 1.25 in
    the first half of the period and 0.75 in the second: by matrix exponentials, and Gauss points in each half."""
    w, zeta, size = model.omega, model.zeta, model.value("eps1") * model.omega**2
    halves = [np.array([[0, 1, 0, 0, 0], [-chi, -2 * zeta, size, 0, model.q1], [0, 0, 0, -w, 0], [0, 0, w, 0, 0],
                        [0, 0, 0, 0, 0]]) for chi in (1.25, 0.75)]  # of z − 1, z', cos ωτ, sin ωτ, 1
    half = np.pi / w
    over = expm(halves[1] * half) @ expm(halves[0] * half)
    start = np.array([*np.linalg.solve(np.eye(2) - over[:2, :2], over[:2, 2] + over[:2, 4]), 1, 0, 1])
    nodes, weights = np.polynomial.legendre.leggauss(80)
    out = np.zeros(highest + 1, complex)
    for i, (A, chi) in enumerate(zip(halves, (1.25, 0.75), strict=True)):
        for t, weight in zip((nodes + 1) / 2 * half, weights / 4, strict=True):
            u, v, *_ = expm(A * t) @ start
            out += weight * (2 * zeta * v + chi * u) * np.exp(-1j * w * (t + i * half) * np.arange(highest + 1))
        start = expm(A * half) @ start
    return np.abs(out) * np.where(np.arange(highest + 1), 2, 1)


def test_the_lines_of_a_force_that_jumps_are_exact():
    """A sampled force is off by 1 % in weak lines: between two instants the place of a jump is not known."""
    gears = pair(k=2000.0, error_amplitudes=[2e-6])
    expected = jumping_lines(gears.to_model(), 32)
    found = gc.orders(gears).order_force[::50]  # the lines of the mesh, in windows of two turns of 25 teeth
    np.testing.assert_allclose(found, expected, rtol=1e-7)
    assert expected[1:].min() < 0.02 * expected[1:].max()


@pytest.mark.parametrize("gears", [
    gc.MeshModel.of(kind="full", omega=0.7, q0=0.1, eps1=0.1, zeta=0.05, mu=3.0, kappa=0.6, damping_law=law)
    for law in ("always", "contact")] + [
    gc.MeshModel.of(omega=0.7, q1=0.1, q2=0.05, beta1=0.01, beta2=0.02, eps1=0.1, zeta=0.05), ordered(1)],
    ids=["always", "contact", "friction", "train"])
def test_the_force_by_the_motion_is_that_by_the_deflection(gears):
    """But for what the place of a jump between two of many instants is worth."""
    start = initial_value_problems(as_model(gears))
    w = classify(start.flow, start.w, settings=SINGLE_MOTION, response=False).w
    samples = ExactFlow(start.flow.system, 2048 * 8).advance(w, 1, sample=True).samples[..., 0]
    (flat,), share = samples, np.arange(2048 * 8) / (2048 * 8)
    by_deflection = mesh_forces(start.flow.system, flat[:, :-1], flat[:, -1], share)
    one, other = (np.abs(np.fft.rfft(force[:, 0]))[:200] for force in (
        force_by_motion(start.flow.system, samples[..., :-1]), by_deflection))
    np.testing.assert_allclose(one, other, atol=3e-3 * other[1:].max())


def test_gears_of_another_backlash_are_compared_in_one_unit():
    found = gc.orders(LINEAR, against=replace(LINEAR, backlash=3.0e-4))
    np.testing.assert_allclose(found.against_order_force, found.order_force, rtol=1e-9, atol=1e-12)


CLUTCHED = gc.Train(
    speed=3000.0, meshes=TRAIN.meshes, bodies=[TRAIN.bodies[0], gc.Body(name="wheel", inertia=3.2e-3),
                                               gc.Body(name="drum", inertia=0.1, torque=-136.0)],
    shafts=[gc.Shaft(name="clutch", between=("wheel", "drum"), stiffness=1e5, damping=1.0, stop=0.1,
                     stop_stiffness=1e6)])


@pytest.mark.parametrize(("gears", "options", "words"), [
    (LINEAR, {"mesh": "z1/z2"}, "mesh must be left out for a single pair"),
    (LINEAR, {"quantity": "noise"}, "quantity must be one of"),
    (LINEAR, {"against": replace(LINEAR, speed=4100.0)},
     "against must have the same speed and numbers of teeth; got '4100 rpm and 25/40 teeth'. The gears have 4000 rpm"),
    (LINEAR, {"against": replace(LINEAR, n1=50, n2=80)}, "50/80 teeth"),
    (LINEAR, {"against": gc.MeshModel()}, "must be a GearDesign or a GearPair"),
    (CLUTCHED, {"mesh": "clutch"}, "mesh must be one of z1/z2")])  # a shaft with stops is no mesh
def test_a_spectrum_that_cannot_be_is_refused(gears, options, words):
    with pytest.raises(gc.InputError, match=words):
        gc.Orders(gears, **options)


@pytest.fixture
def files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("gears.toml").write_text(TRAIN_FILE)
    Path("steady.toml").write_text("\n".join(line for line in TRAIN_FILE.splitlines() if "torque_orders" not in line))


@pytest.mark.slow
def test_the_command_says_first_which_line_and_which_sideband_is_strongest(files):
    arguments = ["orders", "gears.toml", "--against", "steady.toml", "--out", "o.csv"]
    lines = ask(*arguments, code=0).stdout.splitlines()
    assert " ".join(map(str.strip, lines[:4])).startswith(
        "mesh force of z1/z2 at 3000 rpm: strongest line mesh 5, 388.7 N at 6250 Hz; strongest sideband mesh 5 - 1 "
        "turn of pinion, 29.4 dB below its mesh harmonic against the others: new are order 1 of pinion, mesh 5 - 1")
    assert max(map(len, lines)) <= 80
    rows = Path("o.csv").read_text().splitlines()
    assert rows[0] == ("order [1],order_frequency [Hz],mesh,order_force [N],line,sideband_ratio [1],"
                       "against_order_force [N]") and rows[1 + 248].startswith("124.0,6200.0,z1/z2,13.09")
    document = run_json(*arguments[:4], "--of", "acceleration", "--rms")
    first = document["lines"][0]
    assert (document["units"], document["reference"], document["amplitude"]) == ("m/s^2", "1 µm/s²", "rms")
    assert (first["order"], first["frequency"], first["name"]) == (125.0, 6250.0, "mesh 5")
    assert first["level"] == pytest.approx(20 * np.log10(first["amplitude"] / 1e-6))
    (sideband,) = [line for line in document["lines"] if line["order"] == 124]
    assert sideband["difference"] is None and -35 < sideband["sideband_level"] < -25
    assert abs(first["difference"]) < 0.1


@pytest.mark.parametrize("of", ["pair", pytest.param("train", marks=pytest.mark.exhaustive)])
def test_bearings_that_give_way_are_no_part_of_the_transmission_error(of):
    """x1 − x2 of the simulated wheels, whose lateral motion the deflection of the mesh has as well."""
    gears = replace(LINEAR, m1=1.5, m2=3.0, c1=2e8, c2=4e8, k1=1500.0, k2=3000.0)
    motion = gc.simulate(gears.to_model("full"), 32, 3000, samples=64)
    lines = 2 * np.abs(np.fft.rfft(motion.x1 - motion.x2)) / motion.sizes["tau"]
    own = gears.scales.length * lines[32] * 1e6
    held = [replace(body, mass=1.5 * n, support={"stiffness": 2e8 * n, "damping": 1500.0 * n})
            for n, body in enumerate(LINEAR_TRAIN.bodies, 1)]
    chosen = model_of_gears(gears, "full") if of == "pair" else replace(LINEAR_TRAIN, bodies=held)
    error, deflection = (float(gc.physical(gc.orders(chosen, quantity=quantity))[
        f"order_{quantity.replace(' ', '_')}"].sel(order=25)) for quantity in ("transmission error", "deflection"))
    assert error == pytest.approx(own, rel=1e-6) and abs(deflection / own - 1) > 0.05


@pytest.mark.slow
@pytest.mark.parametrize(("sets", "differ"), [
    (["speed=3100 rpm", "torque=60"], False), (["z1/z2.backlash=0.01 mm", "z1/z2.damping=3000"], True)])
def test_a_torque_on_the_command_line_holds_for_both_and_a_design_for_the_first_alone(files, sets, differ):
    options = [part for each in sets for part in ("--set", each)]
    said = run_json("orders", "gears.toml", "--against", "gears.toml", *options)
    differences = [line["difference"] for line in said["lines"]]
    assert any(difference is None or abs(difference) > 0.1 for difference in differences) is differ
