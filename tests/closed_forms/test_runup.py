"""Run-ups: linear motions in closed form, an integration of its own, a fold of a branch, spectra, sound, bad input."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp
from scipy.io import wavfile
from typer.testing import CliRunner

import gearchaos as gc
from gearchaos.cli import app
from gearchaos.flow import OK, ExactFlow, Measure, follow_schedule
from gearchaos.gears.operating import as_model
from gearchaos.model import vary
from gearchaos.model.coordinates import initial_state, prescribed_rates_at_start
from gearchaos.model.switched import switched_system
from gearchaos.sound import RATE, write_wav
from gearchaos.studyfile import load_study
from tests import EXAMPLES

PAIR_FILE = EXAMPLES / "spur_50_50.toml"
PAIR = {"n1": 25, "n2": 40, "I1": 4.88e-4, "I2": 3.2e-3, "R1": 0.03524, "R2": 0.05638, "c0": 4e8, "k": 2000.0,
        "backlash": 1.2e-4, "M10": 85.0, "speed": 4000.0}
LINEAR = gc.GearPair(**PAIR, error_amplitudes=[2e-7], chi1=0.0, chi2=0.0)


@pytest.mark.slow
def test_a_slow_run_has_the_steady_response_of_each_speed():
    """z'' + 2ζz' + z = q + ε1 ω² cos ωτ: the force has the amplitude √(1 + (2ζω)²) |Z| beside the static one."""
    found = gc.runup(LINEAR, "speed=4000:5000", 4.0)
    system = switched_system(vary(as_model(LINEAR), {"speed": found.speed.values}))
    w, damping = system.omega, system.damping  # 2ζ
    force = np.hypot(1, damping * w) * np.abs(system.f_cos[:, 0]) / np.hypot(1 - w**2, damping * w)
    assert not found.contact.any()
    step = np.abs(np.gradient(force))  # from one speed to the next: values are the largest between two
    peak = np.abs(system.static_force[:, 0]) + force
    assert np.all(np.abs(found.mesh_force_peak[0] - peak) < 0.6 * step + 2e-4 * force)
    lines = found.order_force[0]
    assert np.all(np.abs(lines.sel(order=25) - force) < 4 * step + 1e-3 * force)  # windows of two turns
    np.testing.assert_allclose(lines.sel(order=0), system.static_force[:, 0], rtol=1e-4)
    assert float(lines.drop_sel(order=[0, 25]).max()) < 2e-3 * force.max()


@pytest.mark.parametrize(("rate", "largest", "at"), [(1e-3, 9.5917378726, 1.0284941), (1e-4, 9.9950077043, 1.0015178)])
def test_a_run_through_the_resonance_of_a_linear_wheel(rate, largest, at):
    """z'' + 2ζz' + z = cos(.5τ + rate τ²/2), ζ = .05: a wheel under a torque of the first order of its driver."""
    mass, omega0, radius = 1.0, 100.0, 0.05
    k = mass * omega0**2
    bodies = [gc.Body(name="driver", motion=[]), gc.Body(
        name="wheel", inertia=mass * radius**2, torque=-20 * radius,
        torque_orders=[{"order": 1, "amplitude": -radius, "phase": 0.0}])]
    rpm = 60 * omega0 / (2 * np.pi)
    train = gc.Train(speed=0.5 * rpm, bodies=bodies, meshes=[gc.Mesh(
        between=("driver", "wheel"), teeth=(20, 20), base_radii=(radius, radius), stiffness=k,
        damping=0.1 * mass * omega0, backlash=1e-3)])
    found = gc.runup(train, f"speed={0.5 * rpm!r}:{1.5 * rpm!r}", 1 / (rate * omega0))
    amplitude = found.z_peak_to_peak[0] / 2 * train.scales.length * k
    assert not found.contact.any()
    assert float(amplitude.max()) == pytest.approx(largest, rel=10 * rate)
    assert abs(float(amplitude.idxmax()) / rpm - at) < 0.5 / found.sizes["speed"] + 4e-3


@pytest.mark.slow
def test_a_motion_that_visits_speeds_is_that_of_scripts_one_after_the_other():
    """The script of each speed integrates one mesh period by SciPy, in the coordinates of the wheels."""
    model = as_model(gc.GearPair(**{**PAIR, "k": 530.0, "M10": 20.0}, error_amplitudes=[6e-6, 2e-6],
                                 error_phases=[0.3, 1.2], chi1=0.1, chi2=0.2, contact_ratio=1.6))
    speeds = np.random.default_rng(3).uniform(6000, 14000, 10)
    batch = vary(model, {"speed": speeds})
    system = switched_system(batch)
    kicks = np.diff(prescribed_rates_at_start(batch, system.names), axis=0, prepend=np.nan)[:, :, None]
    kicks[0] = 0.0
    start = initial_state(batch, system)[:1].T
    out = follow_schedule(ExactFlow(system, 1), start, np.arange(len(speeds))[:, None], kicks)
    state, z = None, []
    for speed in speeds.tolist():
        script = {"__name__": "script"}
        exec(gc.script(model.with_values({"speed": speed})), script)
        state = script["initial"] if state is None else state
        first = script["relative_motion"](0.0, state)[0]
        z.append(first)
        side = int(first > 1) - int(first < -1)
        for begin, end, level in script["intervals"]:
            state, side = script["advance"](state, side, begin, end, level)
    assert (out.status == OK).all() and out.measures[:, Measure.SWITCHES].sum() > 6
    np.testing.assert_allclose(out.samples[:, 0, 0, 0], z, rtol=0, atol=1e-9)
    np.testing.assert_allclose(out.w[:2, 0], script["relative_motion"](0.0, state), rtol=0, atol=1e-9)


def signal(frequency):
    """A force 3 + 2 sin of a run-up, at instants that become closer and closer."""
    time = np.cumsum(np.linspace(2e-5, 1e-5, 40_000))
    return xr.Dataset({"signal_time": (("direction", "instant"), time[None]),
                       "signal_force": (("direction", "instant"), 3 + 2 * np.sin(2 * np.pi * frequency * time)[None])})


def test_the_sound_has_the_frequency_and_size_of_the_force(tmp_path):
    assert write_wav(signal(440.0), tmp_path / "a.wav") == pytest.approx(2.0, rel=3e-2)  # edges
    rate, heard = wavfile.read(tmp_path / "a.wav")
    line = np.abs(np.fft.rfft(heard * np.hanning(len(heard))))
    assert rate == RATE and heard.dtype == np.int16 and np.abs(heard).max() == 32767
    assert np.argmax(line) * rate / len(heard) == pytest.approx(440, abs=1)
    silent = signal(440.0)
    silent["signal_force"] = 3 + 1e-8 * silent["signal_force"]
    with pytest.raises(gc.InputError, match="must have a mesh force that varies"):
        write_wav(silent, tmp_path / "b.wav")
    with pytest.raises(gc.InputError, match="must be a result of runup with signal=True"):
        write_wav(xr.Dataset(), tmp_path / "b.wav")


@pytest.mark.parametrize(("arguments", "words"), [
    (("speed=6000:500", 60.0), "axis speed must run from a smaller to a larger value"),
    (("speed=0:500", 60.0), "speed must be greater than 0"),
    (("torque=5:50", 60.0), "speed must be an axis of speed"),
    (("speed=500:6000", 0.001), r"at most 5 % within a period; .* At 500 rpm it would change by .* at least"),
    (("speed=500:500.1", 0.01), "duration must be at least that of 50 periods; .* Give 0.245 s or more"),
    (("speed=500:6000", -1.0), "duration must be greater than 0")])
def test_a_run_that_cannot_be_is_refused(arguments, words):
    with pytest.raises(gc.InputError, match=words):
        gc.RunUp(LINEAR, *arguments)


def test_a_dimensionless_model_has_no_speed():
    with pytest.raises(gc.InputError):
        gc.RunUp(gc.MeshModel(), "speed=500:6000")


@pytest.mark.slow
def test_the_run_jumps_at_the_fold_of_the_branch(tmp_path):
    """A run passes the fold by the time that the motion takes to leave: the less, the slower it is."""
    branch = gc.branch(load_study(PAIR_FILE).model.with_values({"speed": 1300.0}), "speed=1200:1330")
    (fold,) = [value for value, kind in zip(branch.event_value.values, branch.event_kind.values, strict=True)
               if kind == "fold" and value < 1290]
    late = []
    for duration in (3, 9):
        result = CliRunner().invoke(app, [
            "runup", str(PAIR_FILE), "--speed", "1200:1330", "--duration", f"{duration} s", "--down", "--json", "--out",
            str(tmp_path / "r.nc"), "--wav", str(tmp_path / "r.wav")])
        assert result.exit_code == 0, result.stderr
        document = json.loads(result.stdout)
        (jump,) = [jump for jump in document["jumps"] if jump["direction"] == "down"]
        assert jump["from"] > jump["to"] > 1
        late.append(fold - jump["speed"])
    assert 0 < late[1] < late[0] < 5
    assert {"jumps", "peaks", "directions"} <= set(document) and document["status"] == "ok"
    with xr.open_dataset(tmp_path / "r.nc") as found:
        assert found.order_force.dims == ("direction", "speed", "order") and found.order_force.attrs["units"] == "N"
    assert wavfile.read(tmp_path / "r.wav")[1].size == pytest.approx(2 * 9 * RATE, rel=1e-3)


@pytest.mark.slow
def test_a_driver_with_a_prescribed_acceleration_does_not_jump_between_periods():
    """A wheel follows its driver as long as its drag exceeds J α: the force is 1 ± J α/drag, at any speed."""
    bodies = [gc.Body(name="driver", motion=[{"order": 2, "acceleration": 300.0}]),
              gc.Body(name="loose", inertia=5e-4, torque=-0.2)]
    train = gc.Train(speed=600.0, bodies=bodies, meshes=[gc.Mesh(
        between=("driver", "loose"), teeth=(20, 30), base_radii=(0.03, 0.045), stiffness=2e8, damping=60.0,
        backlash=1.2e-4)])
    found = gc.runup(train, "speed=600:700", 6.0)
    assert not found.contact.any()
    np.testing.assert_allclose(found.dynamic_factor, 1.5, rtol=1e-3)
    lines = found.order_force[0]
    np.testing.assert_allclose(lines.sel(order=2) / lines.sel(order=0), 0.5, rtol=1e-3)


def test_the_lines_at_low_speed_are_not_those_of_instants_too_far_apart():
    """The mean of the mesh force is the static one, however steep its jumps; more instants give the same lines."""
    model = load_study(PAIR_FILE).model
    few, many = (gc.runup(model, "speed=250:260", 2.0, samples=n).order_force[0] for n in (64, 512))
    static = float(switched_system(vary(model, {})).static_force[0, 0])
    np.testing.assert_allclose(few.sel(order=0), static, rtol=2e-3)
    for order in (50, 100, 150, 200):
        np.testing.assert_allclose(few.sel(order=order), many.sel(order=order), atol=2e-3 * static)


@pytest.mark.slow
def test_a_run_down_goes_on_with_the_motion_of_the_run_up():
    """At 3200 rpm a large motion is reached from lower speeds, and a small one from rest."""
    model = load_study(PAIR_FILE).model
    found = gc.runup(model, "speed=1500:3200", 4.0, down=True).dynamic_factor
    up, down = (found.sel(direction=way)[-3:] for way in ("up", "down"))
    np.testing.assert_allclose(down, up, rtol=2e-2)
    assert float(up.min()) > 5 * gc.regime(model.with_values({"speed": 3200.0})).dynamic_factor


@pytest.mark.slow
def test_the_answer_stands_first_and_the_options_of_a_file_count(tmp_path):
    text = PAIR_FILE.read_text().split("[study]")[0]
    study = '[study]\nkind = "runup"\nspeed = "speed=1250:1270"\nduration = 2\ndown = true\n'
    (tmp_path / "run.toml").write_text(text + study)
    result = CliRunner().invoke(app, ["runup", str(tmp_path / "run.toml")])
    assert result.exit_code == 0, result.stderr
    lines = result.stdout.splitlines()
    assert lines[0].startswith("speed rising: dynamic factor up to ") and max(map(len, lines)) <= 80
    assert any(line.startswith("speed falling: ") for line in lines)
    (tmp_path / "pair.toml").write_text(text)
    missing = CliRunner().invoke(app, ["runup", str(tmp_path / "pair.toml")])
    assert missing.exit_code == 2 and "--speed must be given" in missing.stderr


@pytest.mark.slow
def test_a_fast_run_is_that_at_a_speed_that_rises_continuously():
    """x'' + 2ζz' + z − 1 = q with z = x − ε(φ), φ' = ω(τ). Without steps of ε' it would be off by 1e-3."""
    pair = gc.GearPair(**PAIR, error_amplitudes=[2e-7], error_phases=[np.pi / 2], chi1=0.0, chi2=0.0)
    found = gc.runup(pair, "speed=9000:14000", 0.05, signal=True)
    model, rate = as_model(pair), pair.to_pair().scales.rate
    system = switched_system(vary(model, {"speed": [9000.0]}))
    first, span, amplitude = system.omega[0], 0.05 * rate, model.error.amplitudes[0]
    rise, damping, load = 5 / 9 * first / span, system.damping[0], system.static_force[0, 0]

    def error(t):
        phase, speed = first * t + rise * t**2 / 2 - np.pi / 2, first + rise * t
        return amplitude * np.cos(phase), -amplitude * speed * np.sin(phase)

    def motion(t, state):
        e, e_dot = error(t)
        return [state[1], load - damping * (state[1] - e_dot) - (state[0] - e)]

    tau = np.ravel(found.signal_time) * rate
    steady = -amplitude * first**2 / (1 - first**2 + 1j * damping * first) * np.exp(-0.5j * np.pi)  # of −z, e^iωτ
    start = [load - steady.real + error(0.0)[0], -(1j * first * steady).real + error(0.0)[1]]
    run = solve_ivp(motion, (0.0, tau[-1]), start, t_eval=tau, rtol=1e-10, atol=1e-13)
    e, e_dot = error(tau)
    force = run.y[0] - e + damping * (run.y[1] - e_dot)
    assert np.abs(found.signal_force[0] - force).max() < 8e-4 * np.abs(force - load).max()


@pytest.mark.slow
def test_with_a_drag_over_the_speed_forces_are_over_the_static_one_of_each_speed():
    """The force is 1 + J α r_a/r_b over the drag: 0.3 N m at 600 rpm of the driver, 0.4 N m at 900 rpm."""
    table = {"speed": [200.0, 600.0], "torque": [-0.2, -0.4]}
    bodies = [gc.Body(name="driver", motion=[{"order": 2, "acceleration": 300.0}]),
              gc.Body(name="loose", inertia=5e-4, torque_over_speed=table)]
    train = gc.Train(speed=600.0, bodies=bodies, meshes=[gc.Mesh(
        between=("driver", "loose"), teeth=(20, 30), base_radii=(0.03, 0.045), stiffness=2e8, damping=60.0,
        backlash=1.2e-4)])
    factor = gc.runup(train, "speed=600:900", 8.0).dynamic_factor[0]
    drag = np.interp(factor.speed * 2 / 3, table["speed"], np.abs(table["torque"]))
    np.testing.assert_allclose(factor, 1 + 0.1 / drag, rtol=8e-3)  # half the change from one speed to the next


def test_the_prescribed_rate_of_a_train_is_that_of_its_error():
    """e = a cos(wt − θ) has the rate a w sin θ at first, which the deflection has with the other sign."""
    bodies = [gc.Body(name="driver", motion=[]), gc.Body(name="wheel", inertia=1e-3)]
    train = gc.Train(speed=900.0, bodies=bodies, meshes=[
        gc.Mesh(between=("driver", "wheel"), teeth=(20, 30), base_radii=(0.03, 0.045), stiffness=2e8, damping=60.0,
                backlash=1e-4, error_amplitudes=[3e-6], error_phases=[0.7])])
    batch, units = vary(as_model(train), {"speed": [900.0, 1800.0]}), as_model(train).units
    w = 20 * np.array([900.0, 1800.0]) * np.pi / 30
    expected = -3e-6 * w * np.sin(0.7) / (units.length * units.rate)
    np.testing.assert_allclose(prescribed_rates_at_start(batch, ("z", "z_dot"))[:, 1], expected, rtol=1e-12)
