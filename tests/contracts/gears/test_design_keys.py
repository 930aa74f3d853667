"""No key of a gear design or a gear pair is without effect in silence: a change shows, is refused, or is warned of."""

from __future__ import annotations

from dataclasses import fields, replace
from functools import cache

import numpy as np
import pytest

from gearchaos.datasheet.quantities import datasheet
from gearchaos.errors import InputError
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.mesh.pair import GearPair
from gearchaos.studies.core.axis import parse_axis
from gearchaos.studyfile import load_study
from tests.commands import ask

QUALITY = {"standard": "ISO 1328-1:1995", "grade": 5}
GIVEN = {
    "teeth": [24, 36], "module": "3 mm", "face_width": "30 mm", "bore": "30 mm", "quality": QUALITY,
    "backlash": {"value": "0.12 mm", "of": "line of action, total"}, "damping_ratio": 0.05,
    "transmission_error": "from quality", "speed": "3000 rpm", "torque": "60 N*m",
}
STEEL = {"E": 206e9, "poisson": 0.3, "density": 7830.0}
RELIEF = {"amount": "10 um", "start_diameter": ["76 mm", "112 mm"]}
BASES = {
    "as it is": {},
    "potential energy": {"stiffness": "potential energy"},
    "exact": {"transmission_error": "none"},
    "given masses": {"mass": ["1 kg", "2 kg"], "inertia": ["7e-4 kg*m^2", "3e-3 kg*m^2"]},
    "with relief": {"tip_relief": RELIEF},
    "on supports": {"supports": {"stiffness": "200 N/um", "damping_ratio": 0.05}},
}
CHANGES = {
    "teeth": [24, 37], "internal": True, "module": "3.1 mm", "face_width": "29 mm", "pressure_angle": "21 deg",
    "helix_angle": "10 deg", "centre_distance": "90.1 mm", "profile_shift": [0.1, 0.1], "tip_alteration": "-0.1 mm",
    "rack": {"addendum": 0.95, "dedendum": 1.3, "root_radius": 0.3}, "tip_diameter": ["77.9 mm", "113.9 mm"],
    "tip_relief": {"amount": "20 um", "start_diameter": ["77 mm", "113 mm"], "shape": "parabolic"},
    "material": {"E": "173 GPa", "poisson": 0.25, "density": "7100 kg/m^3"}, "bore": "25 mm",
    "blank": ["solid", {"rim": "9 mm", "web": "12 mm"}], "inertia": ["1e-3 kg*m^2", "4e-3 kg*m^2"],
    "mass": ["1.1 kg", "2.2 kg"], "quality": {"standard": "ISO 1328-1:1995", "grade": 7},
    "backlash": {"value": "0.2 mm", "of": "radial, half"}, "damping_ratio": 0.07, "damping_law": "always",
    "stiffness": "potential energy", "transmission_error": "none", "load_sharing": "prescribed",
    "corner_contact": False, "lead_crowning": "5 um", "lead_slope": "-5 um",
    "eccentricity": "10 um", "pitch_errors": {"seed": 1}, "faults": [{"wheel": 1, "tooth": 5, "stiffness_loss": 0.3}],
    "supports": {"stiffness": "300 N/um", "damping_ratio": 0.07}, "application_factor": 1.25, "speed": "2000 rpm",
    "torque": "50 N*m",
}


def test_every_key_of_a_design_and_of_a_pair_has_a_change_here():
    assert set(CHANGES) == {f.name for f in fields(GearDesign)}
    assert set(PAIR_CHANGES) == {f.name for f in fields(GearPair)}


LOOKS = (
    GearDesign.to_model, GearDesign.to_pair, lambda design: design.to_train() if design.turning else None,
    lambda design: design.warnings, lambda design: design.comparable_stiffnesses,
    lambda design: {name: entry.value for name, entry in datasheet(design).items()},
)
"""All that follows from a design, the values of its datasheet and its page last."""


@cache
def shown(look: int, design: GearDesign) -> object:
    return LOOKS[look](design)


def parts(name: str, value: object):
    """The change of a key, and of each of the values in its table alone."""
    yield value
    if isinstance(value, dict):
        before = {"quality": QUALITY, "backlash": GIVEN["backlash"], "tip_relief": RELIEF, "material": STEEL}
        for key in value:
            yield {**before.get(name, {}), key: value[key]}


@pytest.mark.slow
@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize("name", CHANGES)
def test_a_changed_key_of_a_design_shows(name: str, base: str):
    design = GearDesign(**{**GIVEN, **BASES[base]})
    if (name, base) == ("stiffness", "potential energy"):
        return  # it is that
    for value in parts(name, CHANGES[name]):
        if base == "given masses" and value == {**STEEL, "density": "7100 kg/m^3"}:
            continue  # a material has a density, whether a result needs it or not
        try:
            changed = replace(design, **{name: value})
            differs = any(look(changed) != shown(i, design) for i, look in enumerate(LOOKS))
        except InputError as error:
            assert error.field.startswith(name) or name in str(error)
            continue
        warned = any(text.startswith(f"{name} has no effect") for text in changed.warnings)
        assert changed == design or warned or differs, (name, value)


PAIR = {
    "n1": 25, "n2": 50, "I1": 5e-4, "I2": 8e-3, "R1": "35 mm", "R2": "70 mm", "c0": "400 N/um", "k": "500 N*s/m",
    "backlash": "0.12 mm", "M10": "85 N*m", "speed": "14000 rpm",
}
PAIR_CHANGES = {
    "n1": 26, "n2": 51, "I1": 6e-4, "I2": 7e-3, "R1": "35.1 mm", "R2": "70.1 mm", "c0": "300 N/um", "k": "400 N*s/m",
    "damping_law": "always", "backlash": "0.13 mm", "M10": "80 N*m", "M20": "150 N*m", "speed": "13000 rpm", "b1": 1e-4,
    "b2": 1e-4, "m1": "1 kg", "m2": "2 kg", "c1": "200 N/um", "c2": "200 N/um", "k1": "100 N*s/m", "k2": "100 N*s/m",
    "error_amplitudes": ["5 um"], "error_phases": ["30 deg"], "chi1": 0.2, "chi2": 0.2, "contact_ratio": 1.6,
    "stiffness_amplitudes": ["50 N/um"], "stiffness_phases": ["20 deg"], "stiffness_levels": ["350 N/um", "450 N/um"],
    "stiffness_starts": [0.0, 0.4], "tooth_pairs": {"stiffness": "200 N/um", "contact_ratio": 1.5},
}
SUPPORTS = {"m1": "0.7 kg", "m2": "2.1 kg", "c1": "300 N/um", "c2": "300 N/um", "k1": 0.1, "k2": 0.1}


@pytest.mark.parametrize("base", [{}, SUPPORTS, {"error_amplitudes": ["3 um"]}], ids=["rigid", "supports", "error"])
@pytest.mark.parametrize("name", PAIR_CHANGES)
def test_a_changed_key_of_a_pair_shows(name: str, base: dict):
    pair = GearPair(**{**PAIR, **base})
    try:
        changed = replace(pair, **{name: PAIR_CHANGES[name]})
    except InputError as error:
        assert name in str(error) or error.field == "R1/R2" or name.startswith("stiffness_")
        return
    assert (changed.to_model(), changed.scales) != (pair.to_model(), pair.scales)


@pytest.mark.parametrize(("rows", "words"), [
    *((rows, "constant, 300 N/µm: it excites nothing") for rows in (
        "stiffness [N/um]\n0,300\n1,300\n", "level [N/um]\n0,300\n", "level [N/um]\n0,300\n0.5,300\n")),
    ("level [N/um]\n0,300\n0.5,301\n", ""), ("stiffness [N/um]\n0,200\n0.5,300\n1,200\n", ""),
    *((f"stiffness [N/um]\n0,{value}\n0.5,{value}\n1,{value}\n", "by ISO 6336-1") for value in ("0.45", "45000")),
])
def test_a_stiffness_that_is_constant_or_far_from_iso_6336_is_warned_of(rows, words, tmp_path):
    (tmp_path / "c.csv").write_text(f"fraction,{rows}")
    found = GearDesign(**{**GIVEN, "stiffness": {"table": str(tmp_path / "c.csv")}}).warnings
    assert any(words in text for text in found) if words else not any(
        "it excites nothing" in text or "by ISO 6336-1" in text for text in found)


def test_masses_and_bores_beside_moments_of_inertia_are_warned_of():
    design, supports = GearDesign(**{**GIVEN, **BASES["given masses"]}), BASES["on supports"]["supports"]
    for changes, names in (
        ({}, ["mass", "bore"]), ({"mass": None}, ["bore"]), ({"supports": supports}, ["bore"]), ({"inertia": None}, []),
        ({"supports": supports, "mass": None}, []), ({"stiffness": "potential energy"}, ["mass"]),
    ):
        changed = replace(design, **changes)
        found = [text for text in changed.warnings if "has no effect on the motion: inertia is given" in text]
        assert [text.split()[0] for text in found] == names
        for name in names:
            assert replace(changed, **{name: {"mass": "3 kg", "bore": "20 mm"}[name]}).to_model() == changed.to_model()


DESIGN = """
[design]
teeth = [24, 36]
module = "3 mm"
face_width = "30 mm"
bore = "30 mm"
backlash = { value = "0.12 mm", of = "line of action, total" }
damping_ratio = 0.05
eccentricity = "10 um"
[operation]
speed = "3000 rpm"
torque = "100 N*m"
"""


@pytest.mark.slow
@pytest.mark.parametrize("command", [
    ["gear", "--speed", "2000:2100:2"], ["gear", "--json"], ["regime"], ["simulate", "--periods", "3"], ["script"],
    ["bifurcation", "--axis", "speed=3000:3100:2", "--out", "found.nc"],
])
def test_every_command_shows_the_warnings_of_a_design(command, tmp_path, monkeypatch):
    (tmp_path / "design.toml").write_text(DESIGN)
    monkeypatch.chdir(tmp_path)
    said = ask(command[0], "design.toml", *command[1:]).stderr
    assert said.count("warning: eccentricity acts as an error of ±10 µm; ") == 1, said


def test_an_axis_of_torques_is_warned_of_at_its_least_torque(tmp_path):
    (tmp_path / "design.toml").write_text(DESIGN)
    for axis, warned in (("torque=0.05:60:3", True), ("torque=60:90:3", False)):
        found = load_study(tmp_path / "design.toml", axes=[parse_axis(axis, "axis")]).warnings
        assert any("F_t K_A/b is 0.05" in text or "F_t K_A/b is 0.04" in text for text in found) is warned


@pytest.mark.parametrize(("changes", "words"), [
    ({"transmission_error": None}, "teeth are taken to be exact: transmission_error is left out"),
    ({"transmission_error": "none"}, "teeth are taken to be exact: transmission_error is none"),
    ({"transmission_error": {"orders": "te.csv"}}, "comes from a file, which must contain the relief"),
    ({}, "of the path of contact as it is, at least the base pitch of 8.977 mm"),
    ({"tip_relief": {"amount": "10 um", "start_diameter": ["73.5 mm", "109.5 mm"]}}, "can raise the dynamic factor"),
])
def test_each_way_in_which_tip_relief_does_not_act_as_expected_is_named(changes, words, tmp_path, monkeypatch):
    (tmp_path / "te.csv").write_text("order,peak [um],phase [deg]\n1,3,0\n")
    monkeypatch.chdir(tmp_path)
    design = GearDesign(**{
        **GIVEN, "helix_angle": "10 deg", "load_sharing": "prescribed", "tip_relief": RELIEF, **changes})
    (warning,) = [text for text in design.warnings if text.startswith("tip_relief ")]
    assert words in warning and "the entry of a tooth pair under load, is left out" in warning
    tau = np.linspace(0, 1, 50)
    without = replace(design, tip_relief=None).error_harmonics.at(tau)
    assert np.allclose(design.error_harmonics.at(tau), without, rtol=0, atol=1e-12) is ("has no effect" in warning)
    assert not any(t.startswith("tip_relief") for t in replace(design, tip_relief=0.0).warnings)


def test_what_a_blank_does_not_change_is_warned_of():
    blank = {"rim": "9 mm", "web": "12 mm"}
    found = " ".join(GearDesign(**{**GIVEN, "blank": blank, "stiffness": "potential energy"}).warnings)
    assert "blank has no effect on the motion" in found and "blank has no effect on masses" in found
    assert "blank" not in " ".join(GearDesign(**{**GIVEN, **BASES["given masses"], "blank": blank}).warnings)


def test_a_speed_given_beside_a_file_takes_the_place_of_its_frequency(tmp_path):
    path = tmp_path / "design.toml"
    path.write_text(DESIGN.replace('speed = "3000 rpm"', 'mesh_frequency = "1200 Hz"'))
    assert load_study(path).model.value("speed") == pytest.approx(3000, rel=1e-12)
    assert load_study(path, {"speed": 1500}).model.value("speed") == pytest.approx(1500, rel=1e-12)
