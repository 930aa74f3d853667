"""Faults, pitch errors and eccentricity of designs and trains: closed forms, statistics, tables, refusals."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.datasheet.answer import LIKE_TEETH, DesignAnswer
from gearchaos.errors import DesignWarning, InputError
from gearchaos.gears.geometry.mechanics import STEEL
from gearchaos.gears.operation.operating import as_model
from gearchaos.gears.stiffness.potential_energy import Stations, tooth_compliance
from gearchaos.gears.transmission_error import tolerances
from gearchaos.studyfile import load_study
from tests.closed_forms.linear_gears import PAIR_FILE

DESIGN = gc.GearDesign(
    teeth=(23, 46), module="3 mm", face_width="20 mm", bore="25 mm", damping_ratio=0.05, torque="100 N*m",
    backlash={"value": "0.12 mm", "of": "line of action, total"}, transmission_error="none", speed="2000 rpm",
    quality={"standard": "ISO 1328-1:1995", "grade": 6})


def linear(**given: Any) -> gc.Train:
    """A pair of constant stiffness under a load that keeps its teeth in contact."""
    return gc.Train(speed=1200.0, bodies=[
        gc.Body(name="a", inertia=2e-3, torque=80.0), gc.Body(name="b", inertia=3e-3, torque=-160.0)], meshes=[gc.Mesh(
            **{"between": ("a", "b"), "teeth": (20, 40), "base_radii": (0.03, 0.06), "stiffness": 2e8, "damping": 600.0,
               "backlash": 1e-4, **given})])


def forces(train: gc.Train) -> np.ndarray:
    """The mesh force over a turn of the first wheel, in steps of 1/256."""
    return gc.simulate(train, 1, transient=200, samples=256).mesh_force.values.ravel()[:256]


@pytest.mark.parametrize("wheel", [0, 1])
def test_an_eccentric_wheel_shakes_a_linear_pair_once_per_turn(wheel):
    """|F| = |k + i c Ω| m Ω² E/|k − m Ω² + i c Ω|."""
    length = 30e-6
    train = linear(eccentricity=[length * (n == wheel) for n in (0, 1)])
    mass = 1 / (0.03**2 / 2e-3 + 0.06**2 / 3e-3)
    turn = 1200 * 2 * math.pi / 60 / (1, 2)[wheel]
    spring = 2e8 + 600j * turn
    expected = abs(spring * mass * turn**2 * length / (spring - mass * turn**2))
    found = 2 * abs(np.fft.rfft(forces(train))[1]) / 256 * as_model(train).units.force
    assert found == pytest.approx(expected, rel=1e-8)
    assert train.period == pytest.approx(2 * math.pi / turn)
    assert f"1 turn of {'ab'[wheel]}" in as_model(train).in_words


def test_an_eccentric_wheel_rises_where_its_phase_says():
    first, later = (
        forces(linear(eccentricity=(30e-6, 0), eccentricity_phases=(phase, 0))) for phase in (0, math.pi / 2))
    assert np.roll(first, 64) == pytest.approx(later, abs=1e-9)


def test_a_late_tooth_is_an_error_of_its_cycle():
    """Slowly, with one pair in contact, the deflection is that of the load plus the error, tooth by tooth: those of the
    first wheel stand back, those of the second one come towards it."""
    late = np.random.default_rng(1).uniform(-4e-6, 4e-6, (2, 20))
    train = replace(linear(), speed=200.0, meshes=[replace(
        linear().meshes[0], teeth=(20, 20), base_radii=(0.03, 0.03), damping=3e4, contact_ratio=1.0,
        pitch_errors=late.tolist())], bodies=[linear().bodies[0], replace(linear().bodies[1], torque=-80.0)])
    motion = gc.simulate(train, 1, transient=2, samples=20 * 8)
    model = as_model(train)
    s = motion.z.values[:160].reshape(20, 8)[:, -1] * model.units.length - 0.5e-4
    assert s == pytest.approx(80 / 0.03 / 2e8 + late[0] - late[1], abs=1e-9)


@pytest.mark.parametrize("depth", [2e-4, 5e-4])
def test_a_cracked_beam_bends_as_one_that_is_thinner_behind_the_crack(depth):
    """A tooth with straight sides: half its section is thinner by the depth of a crack at 45° over its whole height."""
    half, height, width = 2e-3, 6e-3, 0.02
    x, w = np.polynomial.legendre.leggauss(8)
    stations = Stations(height * (x + 1) / 2, np.full(8, half), height * w / 2)
    straight = SimpleNamespace(
        slope=lambda angle: np.zeros(()), flank=lambda slope: (np.zeros(()), np.array(height)), base_radius=0.05,
        root_radius=0.045, root_half_angle=0.05, critical_point=(half, 0.0), fillet_stations=lambda: stations,
        flank_stations=lambda angle: stations._replace(weight=0 * w))
    found = tooth_compliance(straight, 0.02, STEEL, width, np.zeros(()), depth)
    thickness = 2 * half - depth / math.sqrt(2)
    assert found.bending == pytest.approx(height**3 / (3 * STEEL.E * width * thickness**3 / 12), rel=1e-12)
    assert found.shear == pytest.approx(1.2 * height * 2.6 / (STEEL.E * width * thickness), rel=1e-12)


def test_a_crack_takes_stiffness_away_and_nothing_where_there_is_none():
    def loss(depth: float) -> float:
        (fault,) = replace(DESIGN, faults=[{"wheel": 1, "tooth": 5, "crack_depth": depth}]).tooth_faults
        return fault.stiffness_loss

    losses = [loss(depth) for depth in (1e-9, 0.5e-3, 1e-3, 2e-3)]
    assert losses[0] == pytest.approx(0, abs=1e-6) and np.all(np.diff(losses) > 0)
    assert 0.02 < losses[2] < 0.2 and 2 * losses[1] < losses[2]  # the deeper, the more a step takes


def test_drawn_pitch_errors_keep_within_the_grade_and_have_its_spread():
    singles = []
    limits = tolerances(DESIGN.quality, DESIGN.geometry)
    cosine = math.cos(DESIGN.geometry.transverse_pressure_angle)
    for seed in range(60):
        for late, limit in zip(replace(DESIGN, pitch_errors={"seed": seed}).late_teeth, limits, strict=True):
            single = np.diff(late, prepend=late[-1]) / cosine
            assert np.abs(single).max() <= limit.single_pitch * (1 + 1e-12)
            assert np.ptp(late) / cosine <= limit.cumulative_pitch * (1 + 1e-12)
            singles.append(single / limit.single_pitch)
    assert 0.28 < np.std(np.concatenate(singles)) < 1 / 3  # a third, less what the limits cut
    assert np.mean(np.concatenate(singles)) == pytest.approx(0, abs=1e-12)
    assert replace(DESIGN, pitch_errors={"seed": 3}).late_teeth == replace(DESIGN, pitch_errors={"seed": 3}).late_teeth


def study_file(folder, line):
    """A study of a pair with 50 teeth each and one more line."""
    text = PAIR_FILE.read_text().replace("[operation]", f"{line}\n[operation]")
    assert line in text
    (folder / "study.toml").write_text(text)
    return folder / "study.toml"


def test_pitch_errors_are_read_from_tables(tmp_path):
    z, design = 50, replace(DESIGN, teeth=(50, 46))
    deviation = np.random.default_rng(0).uniform(-5, 5, z).round(1)
    cumulative, single = tmp_path / "cumulative.csv", tmp_path / "single.csv"
    rows = "".join(f"{n};{d}\n".replace(".", ",") for n, d in zip(range(z, 0, -1), deviation[::-1], strict=True))
    cumulative.write_text(f"tooth;cumulative pitch deviation [um]\n{rows}")
    single.write_text("tooth,single pitch deviation (um)\n" + "".join(
        f"{n},{d:.12g}\n" for n, d in enumerate(np.diff(deviation, prepend=deviation[-1]), 1)))
    found = replace(design, pitch_errors=[str(cumulative), ""]).pitch_errors
    assert found[0] == pytest.approx(deviation * 1e-6) and found[1] == ()
    by_single = replace(design, pitch_errors=[str(single), []]).pitch_errors[0]
    assert np.ptp(np.array(by_single) - found[0]) < 1e-12  # but for a constant, which is a turn of the wheel
    (mesh,) = load_study(study_file(tmp_path, f'pitch_errors = ["{cumulative.name}", ""]')).model.train.meshes
    assert mesh.pitch_errors[0] == pytest.approx(deviation * 1e-6 * math.cos(math.radians(20)))
    cumulative.write_text("tooth,cumulative pitch deviation [um]\n1,2\n3,1\n")
    with pytest.raises(InputError, match=r"line 3.*tooth number 2"):
        replace(design, pitch_errors=[str(cumulative), ""])


@pytest.mark.parametrize(("given", "field", "words"), [
    ({"faults": [{"wheel": 3, "tooth": 1}]}, "faults[0].wheel", "must be 1 or 2"),
    ({"faults": [{"wheel": 1, "tooth": 24, "stiffness_loss": 0.3}]}, "faults[0].tooth", "at most 23"),
    ({"faults": [{"wheel": 1, "tooth": 0}]}, "faults[0].tooth", "from 1 on"),
    ({"faults": [{"wheel": 1, "tooth": 2, "wear": "1 um"}] * 2}, "faults[1].tooth", "no other fault"),
    ({"faults": [{"wheel": 1, "tooth": 2, "stiffness_loss": 30}]}, "faults[0].stiffness_loss", "[0, 1]"),
    ({"faults": [{"wheel": 1, "tooth": 2, "crack_depth": "1 mm", "stiffness_loss": 0.1}]}, "faults[0].crack_depth",
     "beside stiffness_loss"),
    ({"faults": [{"wheel": 1, "tooth": 2, "crack_depth": "9 mm"}]}, "faults: crack_depth", "middle of the tooth"),
    ({"faults": [{"wheel": 1, "tooth": 2, "crack_depth": "1 mm"}], "bore": None, "inertia": 1e-3}, "faults: bore",
     "must be given"),
    ({"faults": [{"wheel": 1, "tooth": 2, "wear": "15 mm"}]}, "faults[0].wear", "fifth of a module"),
    ({"pitch_errors": [[1.0] * 23, []]}, "pitch_errors[0]", "Did you mean"),
    ({"pitch_errors": [[1e-6], []]}, "pitch_errors[0]", "must have 23 values"),
    ({"pitch_errors": {"seed": -1}}, "pitch_errors.seed", "whole number"),
    ({"pitch_errors": {"seed": 1}, "quality": None}, "quality", "must be given"),
    ({"pitch_errors": 3}, "pitch_errors", "list of two")])
def test_teeth_that_cannot_be_are_refused(given, field, words):
    with pytest.raises(InputError) as error:
        replace(DESIGN, **given)
    assert error.value.field == field and words in str(error.value)


@pytest.mark.parametrize(("mesh", "field"), [
    ({"faults": [{"wheel": 1, "tooth": 1, "stiffness_loss": 0.2}]}, "contact_ratio"),
    ({"faults": [{"wheel": 1, "tooth": 1, "crack_depth": "1 mm"}]}, "faults[0].crack_depth"),
    ({"contact_ratio": 0.5}, "contact_ratio"),
    ({"stiffness": None, "tooth_pairs": {"stiffness": 1.5e8, "contact_ratio": 1.6}, "contact_ratio": 1.6},
     "contact_ratio"), ({"eccentricity_phases": (1.0, 0.0)}, "eccentricity_phases[0]")])
def test_meshes_whose_teeth_cannot_differ_so_are_refused(mesh, field):
    with pytest.raises(InputError) as error:
        linear(**mesh)
    assert error.value.field == field


def test_a_common_period_of_both_wheels_that_is_too_long_is_refused():
    with pytest.raises(InputError, match=r"got 4747\. Leave out what repeats with the turn of a wheel"):
        as_model(replace(DESIGN, teeth=(47, 101), eccentricity="10 um"))


def test_what_takes_all_teeth_to_be_alike_says_so():
    cracked = replace(DESIGN, faults=[{"wheel": 1, "tooth": 5, "stiffness_loss": 0.3}])
    with pytest.warns(DesignWarning, match="are left out here"):
        found = gc.dynamic_factor(cracked, "1000:1200:2")
    np.testing.assert_array_equal(found.dynamic_factor, gc.dynamic_factor(DESIGN, "1000:1200:2").dynamic_factor)


def test_teeth_that_are_all_alike_but_weak_or_worn_are_a_weaker_or_looser_mesh():
    every = [{"wheel": 1, "tooth": n, "stiffness_loss": 0.5, "wear": 20e-6} for n in range(1, 21)]
    worn, loose = linear(contact_ratio=1.6, faults=every), linear(stiffness=1e8, backlash=1.2e-4)
    assert gc.regime(worn).meshes["a/b"]["force_peak"] == pytest.approx(80 / 0.03)
    at = [gc.simulate(train, 1, transient=60, samples=80).z.values[-10] for train in (worn, loose)]
    # the unit of length is half the backlash; the first mesh touches where its worn flank is
    assert at[0] == pytest.approx(1 + (20e-6 + 80 / 0.03 / 1e8) / 0.5e-4)
    assert at[1] == pytest.approx(1 + 80 / 0.03 / 1e8 / 0.6e-4)


def test_a_pair_whose_first_teeth_are_missing_begins_beside_them():
    missing = [{"wheel": 1, "tooth": n, "stiffness_loss": 1} for n in (1, 23)]
    other = [{"wheel": 1, "tooth": n, "stiffness_loss": 1} for n in (10, 11)]
    first, later = (gc.regime(replace(DESIGN, faults=faults)) for faults in (missing, other))
    assert first.label == later.label != "diverged"
    assert first.dynamic_factor == pytest.approx(later.dynamic_factor, rel=1e-9)


def test_a_torque_set_beside_a_file_is_that_of_the_design(tmp_path):
    study = study_file(tmp_path, "faults = [{ wheel = 1, tooth = 5, stiffness_loss = 0.3 }]")
    low, also = (load_study(study, values).model for values in ({"torque": 20.0}, {"operation.torque": 20.0}))
    assert low == also != load_study(study).model
    with pytest.raises(InputError, match="torque must not be negative"):
        load_study(study, {"torque": -5.0})


def test_a_fault_of_every_planet_is_refused():
    fault = [{"wheel": 2, "tooth": 1, "stiffness_loss": 0.3}]
    steel = {"mass": 0.5, "inertia": 5e-4}
    mesh = {"stiffness": 5e8, "backlash": 1e-4, "contact_ratio": 1.5}
    with pytest.raises(InputError, match=r"sun_mesh.faults must leave out wheel 2"):
        gc.PlanetarySet(count=3, teeth=(27, 36, 99), module="2.8 mm", sun={"inertia": 5e-4}, ring={"fixed": True},
                        carrier={"inertia": 0.05}, planet=steel, sun_mesh={**mesh, "faults": fault}, ring_mesh=mesh)


def test_wear_and_losses_are_said_where_they_are_large_or_left_out(tmp_path):
    fault = {"wheel": 1, "tooth": 5, "stiffness_loss": 0.3, "wear": "0.3 mm"}
    (warning,) = linear(contact_ratio=1.6, faults=[fault]).warnings
    assert "300 µm, more than the backlash" in warning
    cracked = replace(DESIGN, faults=[{**fault, "wear": 0}])
    assert "pairs of tooth 5 of wheel1 30 % less stiff" in as_model(cracked).in_words
    answer = DesignAnswer.of(cracked, None, None)
    assert ("left out", LIKE_TEETH) in list(answer.facts) and LIKE_TEETH in answer.document()["warnings"][-1]
    assert "left out" not in dict(DesignAnswer.of(DESIGN, None, None).facts)


@pytest.mark.filterwarnings("ignore:eccentricity acts")
@pytest.mark.filterwarnings("ignore:Where teeth differ")
def test_the_warnings_of_the_train_that_a_design_becomes_are_given():
    helical = replace(DESIGN, helix_angle="15 deg", eccentricity=("10 um", 0))
    with pytest.warns(DesignWarning, match="is followed in 48 steps"):
        as_model(helical)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:Where teeth differ")
def test_a_fast_run_up_of_a_cracked_pair_has_all_its_speeds_and_no_jumps_but_resonances():
    found = gc.runup(replace(DESIGN, torque=40.0, faults=[{"wheel": 1, "tooth": 5, "stiffness_loss": 0.3}]),
                     "speed=2000:4000", 10.0)
    assert np.isfinite(found.dynamic_factor).all() and found.sizes["speed"] > 100
    assert found.sizes["jump"] == 0
