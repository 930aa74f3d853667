"""Run-ups: linear motions in closed form, an integration of its own, a fold of a branch, spectra, sound, bad input."""

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp
from scipy.io import wavfile

import gearchaos as gc
from gearchaos.flow import OK, ExactFlow, Measure, follow_schedule
from gearchaos.gears.operation.operating import as_model
from gearchaos.model import vary
from gearchaos.model.coordinates import initial_state, prescribed_rates_at_start
from gearchaos.model.switched import switched_system
from gearchaos.sound import RATE, write_wav
from gearchaos.studyfile import load_study
from tests.closed_forms.linear_gears import LINEAR, PAIR, PAIR_FILE, loose_train, steady_force
from tests.commands import ask, run_json

MODEL = load_study(PAIR_FILE).model


@pytest.mark.slow
def test_a_slow_run_has_the_steady_response_of_each_speed():
    """The force has its amplitude beside the static one."""
    found = gc.runup(LINEAR, "speed=4000:5000", 4.0)
    static, force = steady_force(LINEAR, found.speed)
    assert not found.contact.any()
    step = np.abs(np.gradient(force))  # from one speed to the next: values are the largest between two
    assert np.all(np.abs(found.mesh_force_peak[0] - np.abs(static) - force) < 0.6 * step + 2e-4 * force)
    lines = found.order_force[0]
    assert np.all(np.abs(lines.sel(order=25) - force) < 4 * step + 1e-3 * force)  # windows of two turns
    np.testing.assert_allclose(lines.sel(order=0), static, rtol=1e-4)
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
    assert not found.contact.any() and float(amplitude.max()) == pytest.approx(largest, rel=10 * rate)
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
    (("speed=6000:500", 60.0), "speed must run from a smaller to a larger value"),
    (("speed=0:500", 60.0), "speed must be greater than 0"),
    (("torque=5:50", 60.0), "speed must be an axis of speed"),
    (("speed=500:6000", 0.001), r"at most 5 % within a period; .* At 500 rpm it would change by .* at least"),
    (("speed=500:500.1", 0.01), "duration must be at least that of 50 periods; .* Give 0.245 s or more"),
    (("speed=500:6000", -1.0), "duration must be greater than 0")])
def test_a_run_that_cannot_be_is_refused(arguments, words):
    with pytest.raises(gc.InputError, match=words):
        gc.RunUp(LINEAR, *arguments)
    with pytest.raises(gc.InputError):
        gc.RunUp(gc.MeshModel(), "speed=500:6000")  # has no speed


@pytest.mark.slow
def test_the_run_jumps_at_the_fold_of_the_branch(tmp_path):
    """A run passes the fold by the time that the motion takes to leave: the less, the slower it is."""
    branch = gc.branch(MODEL.with_values({"speed": 1300.0}), "speed=1200:1330")
    fold = branch.event_value.values[branch.event_kind.values == "fold"].min()
    document = run_json("runup", PAIR_FILE, "--speed", "1240:1330", "--duration", "1.5 s", "--down", "--out",
                        tmp_path / "r.nc", "--wav", tmp_path / "r.wav")
    (jump,) = [jump for jump in document["jumps"] if jump["direction"] == "down"]
    assert jump["from"] > jump["to"] > 1
    slower = gc.runup(MODEL, "speed=1240:1330", 4.0, down=True)
    (there,) = slower.speed_of_jump.values[slower.direction_of_jump.values == "down"]
    assert 0 < fold - there < fold - jump["speed"] < 5
    assert {"jumps", "peaks", "directions"} <= set(document) and document["status"] == "ok"
    with xr.open_dataset(tmp_path / "r.nc") as found:
        assert found.order_force.dims == ("direction", "speed", "order") and found.order_force.attrs["units"] == "N"
    assert wavfile.read(tmp_path / "r.wav")[1].size == pytest.approx(2 * 1.5 * RATE, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("wheel", "speeds", "duration", "error"), [
    ({"torque": -0.2}, "600:700", 6.0, 1e-3),
    ({"torque_over_speed": {"speed": [200.0, 600.0], "torque": [-0.2, -0.4]}}, "600:900", 8.0, 8e-3)])
def test_a_driver_with_a_prescribed_acceleration_does_not_jump_between_periods(wheel, speeds, duration, error):
    """A wheel follows its driver as long as its drag exceeds J α r_a/r_b: the force is 1 + 0.1 N m over the drag that
    it has at each speed. The error is half the change from one speed to the next."""
    found = gc.runup(loose_train(wheel=wheel, speed=600.0), f"speed={speeds}", duration)
    assert not found.contact.any()
    drag = np.interp(found.speed * 2 / 3, [200, 600], [0.2, 0.4]) if "torque_over_speed" in wheel else 0.2
    np.testing.assert_allclose(found.dynamic_factor[0], 1 + 0.1 / drag + 0 * found.speed, rtol=error)
    if "torque" in wheel:
        lines = found.order_force[0]
        np.testing.assert_allclose(lines.sel(order=2) / lines.sel(order=0), 0.5, rtol=1e-3)


def test_the_lines_at_low_speed_are_not_those_of_instants_too_far_apart():
    """The mean of the mesh force is the static one, however steep its jumps; more instants give the same lines."""
    few, many = (gc.runup(MODEL, "speed=250:260", 2.0, samples=n).order_force[0] for n in (64, 512))
    static = float(switched_system(vary(MODEL, {})).static_force[0, 0])
    np.testing.assert_allclose(few.sel(order=0), static, rtol=2e-3)
    orders = [50, 100, 150, 200]
    np.testing.assert_allclose(few.sel(order=orders), many.sel(order=orders), atol=2e-3 * static)


@pytest.mark.slow
def test_a_run_down_goes_on_with_the_motion_of_the_run_up():
    """At 3200 rpm a large motion is reached from lower speeds, and a small one from rest."""
    found = gc.runup(MODEL, "speed=1500:3200", 2.0, down=True).dynamic_factor
    up, down = (found.sel(direction=way)[-3:] for way in ("up", "down"))
    np.testing.assert_allclose(down, up, rtol=2e-2)
    assert float(up.min()) > 5 * gc.regime(MODEL.with_values({"speed": 3200.0})).dynamic_factor


@pytest.mark.slow
def test_the_answer_stands_first_and_the_options_of_a_file_count(tmp_path):
    text = PAIR_FILE.read_text().split("[study]")[0]
    study = '[study]\nkind = "runup"\nspeed = "speed=1250:1270"\nduration = 1\ndown = true\n'
    (tmp_path / "run.toml").write_text(text + study)
    (tmp_path / "pair.toml").write_text(text)
    lines = ask("runup", tmp_path / "run.toml", code=0).stdout.splitlines()
    assert lines[0].startswith("speed rising: dynamic factor up to ") and max(map(len, lines)) <= 80
    assert any(line.startswith("speed falling: ") for line in lines)
    assert "--speed must be given" in ask("runup", tmp_path / "pair.toml", code=2).stderr


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
    assert "Up to 32 times the mesh frequency" in found.signal_force.attrs["comment"]
    assert np.abs(found.signal_force[0] - force).max() < 8e-4 * np.abs(force - load).max()


def test_the_prescribed_rate_of_a_train_is_that_of_its_error():
    """e = a cos(wt − θ) has the rate a w sin θ at first, which the deflection has with the other sign."""
    train = loose_train(motion=[], wheel={"torque": 0.0}, error_amplitudes=[3e-6], error_phases=[0.7])
    batch, units = vary(as_model(train), {"speed": [900.0, 1800.0]}), as_model(train).units
    w = 20 * np.array([900.0, 1800.0]) * np.pi / 30
    expected = -3e-6 * w * np.sin(0.7) / (units.length * units.rate)
    np.testing.assert_allclose(prescribed_rates_at_start(batch, ("z", "z_dot"))[:, 1], expected, rtol=1e-12)
