"""Trains on the command line: what is said before the work, the answer, JSON in SI, axes by part, what is refused."""

import math
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

import gearchaos as gc
from gearchaos.cli.modes import print_modes
from gearchaos.cli.runup import runup_document
from gearchaos.cli.trains import print_train
from gearchaos.continuation.natural import Follower, Path
from gearchaos.datasheet.assessment import decision, worst
from gearchaos.errors import InputError
from gearchaos.explorer.core.models import operating_axes
from gearchaos.gears.operation.operating import as_model
from gearchaos.plot import campbell
from gearchaos.studies.maps.bifurcation import Bifurcation
from gearchaos.studies.operation.followed_motions import Motion
from gearchaos.studies.operation.window_edges import continued
from gearchaos.studyfile import load_study
from tests import EXAMPLES
from tests.commands import ask, refused, run_json

LOOSE, IDLER = EXAMPLES / "train_loose_gear.toml", EXAMPLES / "train_idler.toml"
HOLDS = ("--set", "loose.torque=-0.2")


def test_the_first_line_is_the_answer_and_the_train_is_described_before_the_work():
    result = ask("regime", LOOSE, *HOLDS)
    assert result.stdout.splitlines()[0] == "1T: all meshes keep contact"
    assert "2 state variables; everything repeats\n  after 37.5 ms, the period of results\n" in result.stderr
    apart = ask("regime", LOOSE, "--set", "loose.torque=-0.1").stdout.splitlines()
    assert apart[0] == "1T: contact is lost at z1/z2"
    assert max(map(len, [*apart, *result.stdout.splitlines(), *result.stderr.splitlines()])) <= 80


@pytest.mark.parametrize("command", [
    "modes {}", "simulate {} --periods 1", "rattle {} --axis loose.torque=-0.3:-0.2:2"])
def test_a_mode_without_damping_is_named_before_the_work(tmp_path, command):
    path = tmp_path / "undamped.toml"
    path.write_text(LOOSE.read_text().replace('damping = "60 N*s/m"', 'damping = "0.06 N*s/m"'))
    said = ask(*command.format(path).split()).stderr.splitlines()
    assert said[0].startswith("warning: The mode of 4530 Hz is hardly damped, ratio 4.3e-06")
    assert max(map(len, said)) <= 80


def test_mesh_cycles_in_the_common_period_are_said():
    stages = ask("simulate", EXAMPLES / "train_two_stage.toml", "--periods", 1)
    assert "2 ms = 2 mesh cycles of first, 1 mesh cycle of second" in " ".join(stages.stderr.split())


def test_a_verdict_has_its_meshes_in_si():
    found = run_json("regime", LOOSE, *HOLDS)
    verdict = gc.regime(gc.Train(
        speed=800, bodies=[gc.Body(name="driver", motion=[{"order": 2, "acceleration": 300}]),
                           gc.Body(name="loose", inertia=5e-4, torque=-0.2)],
        meshes=[gc.Mesh(name="z1/z2", between=("driver", "loose"), teeth=(20, 30), base_radii=(0.03, 0.045),
                        stiffness=2e8, damping=60, backlash=0.12e-3)]))
    assert found["period"] == 1 and found["common_period"] == pytest.approx(60 / 800 / 2)
    assert found["meshes"] == {"z1/z2": pytest.approx(verdict.meshes["z1/z2"])}
    one = found["meshes"]["z1/z2"]
    assert (one["contact"], one["front_share"], one["back_share"]) == ("permanent", pytest.approx(1), 0)
    # static force and the inertia of the loose wheel: T/r_b + (J/r_b^2) r_a a
    assert one["force_peak"] == pytest.approx(0.2 / 0.045 + 5e-4 / 0.045**2 * 0.03 * 300, rel=1e-3)
    assert one["force_least"] == pytest.approx(0.2 / 0.045 - 5e-4 / 0.045**2 * 0.03 * 300, rel=1e-2)
    assert one["force_mean"] == pytest.approx(0.2 / 0.045, rel=1e-12)  # the mean torques balance
    assert one["impacts_per_second"] == 0 and found["load_shares"] == {}
    assert run_json("regime", LOOSE, "--set", "loose.torque=-0.1")["meshes"]["z1/z2"]["force_least"] == 0


IDLE = gc.Train(
    speed=3000, bodies=[gc.Body(name="motor", inertia=2e-3, torque=20), gc.Body(name="pump", inertia=1e-3, torque=-30),
                        gc.Body(name="idle", inertia=1e-4)],
    meshes=[gc.Mesh(name=f"to {name}", between=("motor", name), teeth=(24, z), base_radii=(0.024, z / 1000),
                    backlash=1e-4, stiffness={"levels": [3e8, 2e8], "starts": [0, 0.6]}, damping=600,
                    error_amplitudes=error)
            for name, z, error in (("pump", 36, []), ("idle", 30, [4e-6]))])
"""A pump whose mesh stays in contact, and a wheel that carries nothing and rattles at any speed."""


@pytest.fixture(scope="module")
def of_idle():
    return gc.assess(IDLE, "500:510:3", starts=2, spacing=0.025, knocks=False)


def test_meshes_that_carry_nothing_are_named_before_they_separate(capsys, of_idle):
    verdict = gc.regime(IDLE)
    print_train(verdict)
    assert capsys.readouterr().out.startswith(
        f"{verdict.label}: no load at rest on to idle; both flanks are hit at to idle; all others\n  keep contact")
    assert verdict.meshes["to idle"]["dynamic_factor"] is None
    assert of_idle.at[0].unloaded == ("to idle",) and of_idle.at[0].windows[0].meshes == ("to idle",)
    said = decision(of_idle)
    assert said[0] == ("at 20 N m to idle carries no load at rest: what is to be avoided is that rattle alone, no "
                       "other mesh separates")
    assert said[1].startswith("at 20 N m avoid ")
    (at,) = of_idle.at
    for meshes in ((), ("to idle", "to pump")):  # a force that is too large, another mesh too
        also = replace(of_idle, at=(replace(at, windows=(replace(at.windows[0], meshes=meshes),)),))
        assert decision(also)[0].endswith("ranges to avoid include those of that rattle")
    assert decision(replace(of_idle, at=(replace(at, windows=()),)))[0].startswith("at 20 N m no speed")
    unknown = at.dataset.assign(mesh_dynamic_factor=at.dataset.mesh_dynamic_factor * math.nan)
    assert replace(at, dataset=unknown).unloaded == ()  # where all motions diverge it is not known


def test_the_largest_dynamic_factor_is_said_with_its_mesh(of_idle):
    assert " in to pump is " in worst(of_idle)
    train = gc.open(IDLER)
    found = gc.assess(train, "2000:2040:3", starts=0, knocks=False)
    assert worst(found).startswith("the largest dynamic factor in idler/pump is ")
    (at,) = found.at
    assert float(at.dataset.mesh_dynamic_factor.max()) == pytest.approx(at.largest.dynamic_factor)
    for speed, factors in zip(at.dataset.speed.values, at.dataset.mesh_dynamic_factor.sel(motion="rest").values,
                              strict=True):
        meshes = gc.regime(train.at(speed=float(speed))).meshes.values()
        assert factors.tolist() == pytest.approx([mesh["dynamic_factor"] for mesh in meshes], rel=1e-6)


def test_the_factors_of_meshes_go_on_with_an_orbit():
    model = as_model(gc.open(IDLER))
    here, there = (gc.regime(model.with_values({"speed": speed})) for speed in (2000.0, 2010.0))
    w = np.array([here.section[name][0] for name in model.state_names])
    found = Follower(model, "speed").orbits([Path({}, 2000.0, 2010.0, 1, w)], np.array([2010.0]), w[:, None])
    factors = [mesh["dynamic_factor"] for mesh in there.meshes.values()]
    assert found.mesh_factors[0].tolist() == pytest.approx(factors, rel=1e-9) and found.factor[0] == max(
        found.mesh_factors[0])
    assert continued(found, 0, Motion(1, 1, 0, 1.0, 0.5, (0.0, 0.0), w)).factors == found.mesh_factors[0].tolist()


def test_a_mode_that_speeds_may_pass_is_named():
    train = replace(IDLE, meshes=tuple(replace(mesh, damping=20.0) for mesh in IDLE.meshes))
    found = gc.natural_frequencies(train)
    weak = found.isel(mode=1 + int(found.damping_ratio[1:].values.argmin()))
    frequency = float(weak.natural_frequency)
    assert gc.assess(train, "2000:2005:2", starts=0, knocks=False).at[0].coarse.endswith(
        f"at a damping ratio of {float(weak.damping_ratio):.3g} of the mode of {frequency:.4g} Hz, met at "
        f"{60 * frequency / 24:.4g} rpm a resonance may pass between the first speeds")


def test_a_peak_of_a_run_up_is_said_with_the_natural_frequency_that_is_near():
    train = replace(IDLE, meshes=IDLE.meshes[:1], bodies=IDLE.bodies[:2])
    natural = float(gc.natural_frequencies(train).natural_frequency[1])
    peaks = runup_document(gc.runup(train, "speed=300:2000", 2.0), None, as_model(train))["peaks"]
    near = [peak for peak in peaks if peak["natural_frequency"]]
    assert near and all(peak["frequency"] == pytest.approx(peak["order"] * peak["speed"] / 60) for peak in peaks)
    assert all(peak["natural_frequency"] == pytest.approx(natural) for peak in near)
    assert [bool(peak["natural_frequency"]) for peak in peaks] == [
        abs(peak["frequency"] - natural) <= 0.1 * natural for peak in peaks]


@pytest.mark.slow
def test_of_many_exponents_the_largest_are_printed():
    lines = ask("regime", EXAMPLES / "train_planetary.toml").stdout.splitlines()
    assert [line.strip() for line in lines if "more:" in line] == 2 * ["and 20 more: --json has all"]
    first = next(i for i, line in enumerate(lines) if line.startswith("Lyapunov exponents"))
    assert "more:" in lines[first + 8] and lines[first + 9].startswith("Floquet multipliers")


@pytest.mark.slow
def test_planets_that_share_a_load_alike_are_one_row():
    lines = ask("regime", EXAMPLES / "train_planetary.toml").stdout.splitlines()
    at = next(i for i, line in enumerate(lines) if line.startswith("load of"))
    mean = f"{200 / 3 / (27 * 2.8e-3 * math.cos(math.radians(24.6)) / 2):.4g}"
    assert [line.split()[:5] for line in lines[at + 1 : at + 3]] == [
        [body, "1.000", "33.3", "%", mean] for body in ("sun", "ring")]
    assert lines[at + 1].endswith("sun/planet1 and 2 alike") and max(map(len, lines)) <= 80


@pytest.mark.slow
def test_a_printed_section_has_the_deflections_of_six_meshes_in_80_columns():
    lines = ask("simulate", EXAMPLES / "train_planetary.toml", "--periods", 2).stdout.splitlines()
    assert lines[0] == "Deflections of the meshes after each common period, last 2 of 2 periods"
    words = {word for line in lines[1:-2] for word in line.split()}
    planets = {f"planet{n}{end}" for n in (1, 2, 3) for end in ("", "/")}
    assert words == {"tau", "(ms)", "(µm)", "sun/", "ring", *planets}
    assert max(map(len, lines)) <= 80


def test_a_simulation_has_deflections_in_metres():
    found = run_json("simulate", LOOSE, *HOLDS, "--periods", 40)["meshes"]["z1/z2"]
    assert len(found["deflection"]) == len(found["deflection_rate"]) == 40
    m, w = 5e-4 / 0.045**2, 2 * 2 * math.pi * 800 / 60  # forced by -r_a a cos(w t), from the static deflection
    response = 0.03 * 300 * m / (2e8 - m * w**2 + 60j * w)
    assert found["deflection"][-1] == pytest.approx(0.2 / 0.045 / 2e8 + response.real, rel=1e-6)
    assert found["deflection_rate"][-1] == pytest.approx((1j * w * response).real, rel=1e-4)


def test_an_axis_is_named_as_the_part_and_its_variable_as_files_can(tmp_path):
    out = tmp_path / "map.nc"
    ask("zones", LOOSE, "--axis", "z1/z2.backlash=5e-5:1e-4:2", "--axis", "torque=-0.3:-0.2:2", "--out", out)
    with xr.open_dataset(out) as found:
        assert set(found.sizes) == {"z1_z2.backlash", "torque", "mesh"}
        assert (found.mesh_contact == 0).all()  # permanent


def test_a_store_takes_a_train(tmp_path):
    text = LOOSE.read_text().replace("-0.4:-0.02:96", "-0.4:-0.2:2")
    path, store = tmp_path / "train.toml", tmp_path / "run.zarr"
    path.write_text(text)
    ask("run", path, "--out", store)
    assert gc.load(store).drop_attrs().identical(load_study(path).study(Bifurcation).run().drop_attrs())


@pytest.mark.parametrize(("command", "field"), [
    ("gear {}", "study file must have a table [design]"), ("gear {}", "gearchaos assess says which speeds"),
    ("script {} --for julia", "tool must be one of scipy, opentorsion, ross for a train"),
    ("prove-chaos {}", "model must be a single pair for a proof"), ("regime {} --prove", "model must be a single pair"),
    ("manifolds {} --out m.nc", "model must be a single pair for manifolds"),
    ("zones {} --axis speed=500:900:2 --axis loose.tork=1:2:2 --out z.nc", "must be one of"),
    ("zones {} --axis omega=1:2:2 --axis speed=500:900:2 --out z.nc", "must be one of"),
    ("regime {} --set kind=full", "kind must be left out for a train")])
def test_what_takes_no_train_says_so(command, field):
    result = ask(*command.format(LOOSE).split())  # some describe the train first
    assert result.exit_code == 2 and field in result.stderr


@pytest.mark.parametrize(("name", "words"), [
    ("sunn.inertia", "such as sun.inertia, "), ("sunn.inertia", "Did you mean 'sun.inertia'? Names are those of parts"),
    ("sunn.inertia", "inertia, torque, damping of bodies; stiffness, damping, stop, stop_back of shafts; stiffness, "),
    ("train.planets.position_errors", "must be one of those that can be varied"),
    ("planet1.position_error", "edit it there"), ("planet1.pin.stiffness", "edit it there"),
    ("position_errors", "edit it there"), ("train.speed", "edit it there")])
def test_a_name_that_a_train_does_not_have_is_told_the_nearest_ones(name, words):
    said = " ".join(refused("modes", EXAMPLES / "train_planetary.toml", "--set", f"{name}=3").split())
    assert words in said and len(said) < 450 and said.count(" planet") <= 8


def test_torques_that_no_longer_balance_are_refused():
    assert "-30 N m would balance them" in refused("regime", IDLER, "--set", "pump.torque=-29")
    assert ask("simulate", IDLER, "--set", "torque=10", "--periods", 1).exit_code == 0


def test_the_campbell_diagram_has_the_speeds_that_are_asked_for(tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr("gearchaos.plot.campbell", lambda *args, **options: drawn.append(options) or campbell(
        *args, **options))
    ask("modes", EXAMPLES / "train_two_stage.toml", "--speed", "500:4000", "--plot", tmp_path / "c.png", code=0)
    assert drawn == [{"speed": 4000.0}] and (tmp_path / "c.png").stat().st_size > 10_000


def test_modes_are_said_with_the_speeds_that_meet_them(tmp_path):
    path = EXAMPLES / "train_two_stage.toml"
    result = ask("modes", path, "--plot", tmp_path / "campbell.png", "--out", tmp_path / "m.nc")
    lines = result.stdout.splitlines()
    assert " ".join(result.stdout.split()).startswith(
        "lowest natural frequency 570.47 Hz, met by the mesh frequency: that of first at 1711.4 rpm, that of second at "
        "3422.8 rpm of motor")
    assert max(map(len, lines)) <= 80 and (tmp_path / "campbell.png").stat().st_size > 10_000
    train, found = gc.open(path), gc.load(tmp_path / "m.nc")
    rigid, lowest, *_ = run_json("modes", path)["modes"]
    assert found.equals(gc.natural_frequencies(train)) and rigid["damping_ratio"] is None and rigid["met_at"] == {}
    assert lowest["frequency"] == found.natural_frequency[1] and lowest["damping_ratio"] == found.damping_ratio[1]
    assert lowest["shares"] == {
        **{str(n): float(found.kinetic_energy.sel(body=n)[1]) for n in found.body.values},
        **{str(n): float(found.strain_energy.sel(element=n)[1]) for n in found.element.values}}
    at = lowest["met_at"]["mesh first"]
    assert at / 60 * float(train.mesh_order(train.meshes[0])) == pytest.approx(lowest["frequency"], rel=1e-12)
    assert "must have a table [design], [gearpair] or [train]" in refused("modes", EXAMPLES / "fig02.toml")


def test_meetings_of_harmonics_and_modes_are_those_within_the_speeds():
    path = EXAMPLES / "train_two_stage.toml"
    found = run_json("modes", path, "--speed", "500:4000")
    orders = {"mesh first": 20, "mesh second": 10}  # of the motor: 20 teeth, and 20 of a wheel half as fast
    expected = sorted((60 * mode["frequency"] / (n * order), name, n, number) for name, order in orders.items()
                      for n in (1, 2, 3) for number, mode in enumerate(found["modes"], 1) if not mode["rigid"])
    within = [each for each in expected if 500 <= each[0] <= 4000]
    assert 0 < len(within) < len(expected) and found["speeds"] == [500, 4000]
    assert [tuple(each.values()) for each in found["meetings"]] == [
        (pytest.approx(speed), *others) for speed, *others in within]
    lines = ask("modes", path, "--speed", "500:4000").stdout.splitlines()
    assert lines[0].startswith(f"{len(within)} meetings") and max(map(len, lines)) <= 80
    assert any(line.split()[:3] == ["570", "3×", "first"] for line in lines)
    assert run_json("modes", path, "--speed", "850")["meetings"] == found["meetings"][1:2]  # within 10 %
    assert "meetings" not in run_json("modes", path)
    for wrong in ("500:4000:3", "4000:500", "500:x"):
        assert refused("modes", path, "--speed", wrong).strip().endswith("E.g. 3000 or 500:4000.")
    assert "order 2 of driver" in ask("modes", LOOSE, "--speed", "135 krpm").stdout


WALL = """
[train]
speed = "600 rpm"
bodies = [{ name = "frame", motion = [] },
          { name = "mass", inertia = 1, torque_orders = [{ order = 1, amplitude = 100 }] }]
[[train.shafts]]
name = "wall"
between = ["mass", "frame"]
stiffness = "1000 N*m/rad"
damping = "3 N*m*s/rad"
stop = "0.01 rad"
stop_back = "1000 rad"
stop_stiffness = "1e5 N*m/rad"
"""


def test_a_train_of_stops_alone_has_angles_and_torques(tmp_path):
    path = tmp_path / "wall.toml"
    path.write_text(WALL)
    lines = ask("regime", path).stdout.splitlines()
    assert lines[0] == "1T: contact is lost at wall" and max(map(len, lines)) <= 80
    assert lines[2].split()[:5] == ["shaft", "contact", "front", "back", "peak"] and "peak (N m) rms (N m)" in lines[2]
    assert any(line.startswith("rms of z, wall") and line.endswith("µrad") for line in lines)
    modes = " ".join(ask("modes", path).stdout.split())
    assert "order 1 of mass at 301.98 rpm of frame; stops beside the spring of wall open met" in modes
    assert " ζ 1× energy" in modes
    asked = ask("simulate", path, "--periods", 1, "--samples", 4, "--physical", "--out", tmp_path / "wall.csv")
    titles = (tmp_path / "wall_tau_mesh.csv").read_text().splitlines()[0]
    assert asked.exit_code == 0 and "deflection [urad],deflection [rad]" in titles and "mesh_force [N*m]" in titles
    for command in (["orders"], ["runup", "--speed", "500:600"]):
        assert "model must have a mesh" in ask(command[0], path, *command[1:], code=2).stderr
    with pytest.raises(InputError, match="must have at least one entry to be explored"):
        operating_axes(gc.open(path))


def test_the_torques_of_stops_beside_meshes_have_their_unit(tmp_path):
    path = tmp_path / "spline.toml"
    path.write_text(LOOSE.read_text() + """
[[train.bodies]]
name = "hub"
inertia = "5e-4 kg*m^2"
torque = "-0.2 N*m"
[[train.shafts]]
name = "spline"
between = ["loose", "hub"]
stop = "0.001 rad"
stop_stiffness = "1e5 N*m/rad"
stop_damping = "1 N*m*s/rad"
""")
    said = ask("regime", path).stdout
    assert " peak (N) rms (N) " in said and "\npeak and rms of the stops of spline are torques, N m\n" in said
    assert "torques, N m" not in ask("regime", LOOSE, *HOLDS).stdout
    mesh, stops = ask("rattle", path, "--axis", "loose.torque=-0.3:-0.2:2").stdout.split("spline, from rest")
    assert " (N) rms (N) " in mesh and "N m" not in mesh.partition("z1/z2, from rest")[2]
    assert " (N m) rms (N m) " in stops and "(N)" not in stops
    assert float(stops.splitlines()[-1].split()[-3]) == pytest.approx(0.2, rel=1e-3)


def test_modes_say_which_stops_are_open_and_which_closed():
    bodies = [gc.Body(name=name, inertia=1) for name in "abcd"]
    stop = {"stop": 0.01, "stop_stiffness": 1e5}
    train = gc.Train(speed=600, bodies=bodies, shafts=[
        gc.Shaft(between=("a", "b"), stiffness=1e3, **stop), gc.Shaft(between=("b", "c"), **stop),
        gc.Shaft(between=("c", "d"), stiffness=1e3)])
    found = gc.natural_frequencies(train)
    assert found.attrs["contacts"] == "stops of b-c closed, stops beside the spring of a-b open"
    # the chain with these three springs: det(K - w^2) of free masses of 1
    k = np.array([1e3, 1e5, 1e3])
    chain = np.diag([*k, 0]) + np.diag([0, *k]) - np.diag(k, 1) - np.diag(k, -1)
    expected = np.sqrt(np.linalg.eigvalsh(chain)[1:]) / (2 * np.pi)
    np.testing.assert_allclose(found.natural_frequency[1:], expected, rtol=1e-12)


def test_meshes_of_one_order_are_said_once(capsys):
    bodies = [gc.Body(name=name, inertia=1e-3) for name in "abcde"]
    mesh = {"base_radii": (0.02, 0.02), "stiffness": 1e8, "backlash": 1e-4}
    train = gc.Train(speed=600, bodies=bodies, shafts=[gc.Shaft(between=("c", "d"), stiffness=1e4)], meshes=[
        gc.Mesh(between=tuple(ends), teeth=(z, z), **mesh) for ends, z in (("ab", 20), ("bc", 20), ("de", 15))])
    print_modes(gc.natural_frequencies(train))
    first = " ".join(capsys.readouterr().out.split())
    assert "that of a/b at " in first and "that of d/e at 1654.8 rpm of a;" in first and "of b/c" not in first


@pytest.mark.parametrize(("name", "kind"), [
    ("spur_50_50", gc.GearDesign), ("physical_pair", gc.GearPair), ("train_idler", gc.Train), ("fig02", gc.MeshModel)])
def test_a_file_is_opened_as_what_it_describes(name, kind):
    path = EXAMPLES / f"{name}.toml"
    assert type(gc.open(path)) is kind
    with pytest.raises(InputError, match=r"must be a NetCDF file; .* gearchaos.open reads"):
        gc.load(path)


def test_values_replace_those_of_an_opened_file():
    design = gc.open(EXAMPLES / "spur_50_50.toml", {"design.damping_ratio": 0.02, "speed": 900.0})
    assert (design.damping_ratio, design.speed) == (0.02, 900.0)
    assert gc.open(EXAMPLES / "fig02.toml", {"omega": 0.5}).omega == 0.5
