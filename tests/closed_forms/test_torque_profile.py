"""Run-ups with a torque that changes: steady motions of each torque, units that depend on it, tables, bad input."""

import numpy as np
import pytest
import xarray as xr

import gearchaos as gc
from gearchaos.gears.operation.operating import as_model
from gearchaos.model import vary
from gearchaos.model.switched import switched_system
from gearchaos.studyfile import load_study
from tests import EXAMPLES, ONE_SPRING
from tests.closed_forms.linear_gears import LINEAR, PAIR_FILE, steady_force
from tests.commands import ask

MODEL = load_study(PAIR_FILE).model
CONSTANT = {"time": [0.0, 3.0, 8.0], "torque": [60.0, 60.0, 60.0]}


@pytest.mark.slow
@pytest.mark.parametrize(("file", "speeds"), [
    (ONE_SPRING, "speed=1240:1270"), (EXAMPLES / "train_idler.toml", "speed=500:505")])
def test_a_constant_profile_gives_the_bits_of_that_torque(file, speeds):
    model = load_study(file).model
    profile = gc.runup(model, speeds, 0.5, down=True, torque=CONSTANT).drop_vars("torque")
    plain = gc.runup(model.with_values({"torque": 60.0}), speeds, 0.5, down=True)
    xr.testing.assert_identical(profile.drop_attrs(), plain.drop_attrs())


@pytest.mark.slow
def test_a_slow_ramp_has_the_steady_force_of_each_torque():
    """The amplitude of the linear response does not depend on the load: the force is static(M) ± A."""
    profile = {"speed": [4000, 4125], "torque": [20.0, 70.0]}
    found = gc.runup(LINEAR, "speed=4000:4125", 1.0, down=True, torque=profile)
    torque = np.interp(found.speed, profile["speed"], profile["torque"])
    static, amplitude = steady_force(LINEAR, found.speed)
    assert not found.contact.any()
    np.testing.assert_allclose(found.torque, np.stack([torque] * 2), atol=0.5 * 50 / 1000 + 1e-9)
    for factor in found.dynamic_factor:  # the largest beside the centre of a bin
        np.testing.assert_allclose(factor, 1 + amplitude / (static * torque / LINEAR.M10), rtol=6e-3)


@pytest.mark.slow
def test_where_the_units_depend_on_the_torque_forces_are_still_those_of_steady_motions():
    """c0 and with it ω0 and ζ of this design follow the load: a state that kept its numbers would be another one."""
    model = MODEL.with_values({"speed": 900.0})
    found = gc.physical(gc.runup(model, "speed=900:903", 2.0, torque={"time": [0, 2], "torque": [40, 55]}))
    radius = model.gears.to_pair().R1
    for i in (found.sizes["speed"] // 20, found.sizes["speed"] // 2, found.sizes["speed"] * 19 // 20):
        torque = float(found.torque[0, i])
        steady = gc.regime(model.with_values({"speed": float(found.speed[i]), "torque": torque}))
        assert float(found.dynamic_factor[0, i]) == pytest.approx(steady.dynamic_factor, rel=4e-3)
        newton = steady.dynamic_factor * torque / radius
        assert float(found.mesh_force_peak[0, i]) == pytest.approx(newton, rel=4e-3)
    lines = found.order_force[0].sel(order=0)  # the force changes by 1/radius in a window of two turns
    np.testing.assert_allclose(lines[::40], found.torque[0, ::40] / radius, atol=1.0 / radius)


@pytest.mark.slow
def test_a_torque_that_changes_its_sign_brings_the_teeth_to_the_other_flank():
    found = gc.runup(LINEAR, "speed=4000:4150", 2.0, torque={"time": [0, 1, 2], "torque": [50.0, -50.0, -50.0]})
    contact = found.contact[0].values
    assert contact[0] == contact[-1] == 0 < contact.max() and found.sizes["jump"] == 0
    static = switched_system(vary(as_model(LINEAR.at(torque=50.0)), {})).static_force[0, 0]
    assert float(found.dynamic_factor[0, -1]) == pytest.approx(float(found.mesh_force_peak[0, -1]) / static, rel=1e-9)
    # where the torque vanishes, the factor has no bound; the force has
    assert float(found.dynamic_factor.max()) > 5 > 1.2 > float(found.mesh_force_peak.max()) / static


@pytest.mark.slow
def test_without_torque_the_dynamic_factor_is_not_a_number():
    found = gc.runup(LINEAR, "speed=4000:4150", 2.0, torque={"time": [0, 1, 1.25, 2], "torque": [0, 0, 50, 50]})
    factor = found.dynamic_factor[0].values
    assert np.isnan(factor[: len(factor) // 2 - 8]).all() and np.isfinite(factor[-20:]).all()
    assert np.isfinite(found.mesh_force_peak).all()


def test_where_the_torque_jumps_the_motion_does_not():
    """From 30 to 90 N m in 10 ms the range of the force grows by more than a quarter, by the stiffness that varies."""
    found = gc.runup(MODEL, "speed=800:820", 4.0, torque={"time": [0, 2, 2.01, 4], "torque": [30, 30, 90, 90]})
    peak = found.mesh_force_peak[0]
    assert float(peak[-1]) > 2 * float(peak[0]) and found.sizes["jump"] == 0


@pytest.mark.slow
def test_files_are_read_as_other_tables_and_found_beside_the_study(tmp_path):
    (tmp_path / "load.csv").write_text("Zeit [min];Wellenmoment [kN m]\n0;0,06\n0,05;0,06\n1;0,06\n", encoding="utf-8")
    text = PAIR_FILE.read_text().replace('torque = "100 N*m"', 'torque = "60 N*m"')
    study = '[study]\nkind = "runup"\nspeed = "speed=1250:1262"\nduration = 0.5\n'
    (tmp_path / "run.toml").write_text(text + study + 'torque = "load.csv"\n')
    (tmp_path / "plain.toml").write_text(text + study)
    (tmp_path / "bare.toml").write_text(text.split("[operation]")[0] + study)
    found = []
    for file, options in (("run", []), ("plain", []), ("bare", ["--torque", tmp_path / "load.csv"])):
        said = ask("runup", tmp_path / f"{file}.toml", *options, "--out", tmp_path / f"{file}.nc", code=0).stderr
        found.append(gc.load(tmp_path / f"{file}.nc"))
    assert "torque is 'Wellenmoment [kN m]'" in said
    run, plain, bare = found
    assert (run.torque == 60).all() and "torque" not in plain
    xr.testing.assert_identical(run.drop_attrs(), bare.drop_attrs())
    xr.testing.assert_identical(run.drop_vars("torque").drop_attrs(), plain.drop_attrs())


@pytest.mark.parametrize(("profile", "words"), [
    ({"time": [0, 3], "torque": [1, 2]}, "must have the torque from 0 to 4 s; got '0 to 3 s'"),
    ({"speed": [4100, 5000], "torque": [1, 2]}, "must have the torque from 4000 to 4300 rpm; got '4100 to 5000 rpm'"),
    ({"time": [0, 2, 2, 4], "torque": [1, 2, 3, 4]}, "must have rows with rising time"),
    ({"time": [0, 4], "torque": [1, 2, 3]}, "must have two or more rows"),
    ({"time": [0, 4], "torque": [1, np.inf]}, "torque must be finite|must be a finite"),
    ({"time": [0, 4], "speed": [4000, 5000], "torque": [1, 2]}, "must be a table of time or speed, and torque"),
    (100.0, "must be a table of time or speed, and torque"), ("missing.csv", "must be a file that can be read")])
def test_a_profile_that_cannot_be_is_refused(profile, words):
    with pytest.raises(gc.InputError, match=words):
        gc.RunUp(LINEAR, "speed=4000:4300", 4.0, torque=profile)


def test_a_profile_that_the_gears_cannot_have_is_refused(tmp_path):
    (tmp_path / "t.csv").write_text("time [s],torque [N m]\n0,10\n2,20\n1,30\n")
    for gears, down, profile, words in (
            (MODEL, False, {"time": [0, 4], "torque": [0, 100]}, "torque must be greater than 0"),
            (LINEAR, True, {"time": [0, 4], "torque": [10, 100]}, "must have the torque from 0 to 8 s"),
            (LINEAR, False, str(tmp_path / "t.csv"), "line 4, must have a greater time than line 3")):
        with pytest.raises(gc.InputError, match=words):
            gc.RunUp(gears, "speed=4000:4300", 4.0, down=down, torque=profile)
