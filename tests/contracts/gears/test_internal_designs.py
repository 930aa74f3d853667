"""Drawings of a pinion in a ring: what follows from them, what of a ring is left out, and where they are used."""

import json
import math
import tomllib
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.path import Path
from scipy.optimize import brentq

import gearchaos as gc
from gearchaos.cards.inputs import inputs_in_words
from gearchaos.datasheet.quantities import datasheet
from gearchaos.explorer.core.drawing import Drawing
from gearchaos.explorer.core.opened import study_view
from gearchaos.gears.design.transverse_section import RIM, transverse_section
from gearchaos.gears.geometry.dimensions import Geometry
from gearchaos.gears.geometry.root_stress import root_factors
from gearchaos.gears.operation.operating import gears_from_json, gears_json, gears_of
from gearchaos.studyfile import load_study
from tests.commands import ask, run_json

RING = """[design]
teeth = [20, 61]
internal = true
module = "3 mm"
face_width = "20 mm"
profile_shift = [0.2, -0.2]
tip_alteration = [0, "-0.4 mm"]
inertia = ["2e-4 kg*m^2", "2e-2 kg*m^2"]
quality = { standard = "ISO 1328-1:1995", grade = 6 }
transmission_error = "none"
backlash = { value = "0.12 mm", of = "line of action, total" }
damping_ratio = 0.05
load_sharing = "prescribed"

[operation]
torque = "60 N*m"
speed = "3000 rpm"
"""
TRAIN = """[train]
speed = "3000 rpm"

[[train.bodies]]
name = "pinion"
inertia = "2e-4 kg*m^2"
torque = "60 N*m"

[[train.bodies]]
name = "ring"
inertia = "2e-2 kg*m^2"
torque = "-183 N*m"

[[train.meshes]]
between = ["pinion", "ring"]
design = "ring.toml"
"""


@pytest.fixture
def ring(tmp_path):
    (tmp_path / "ring.toml").write_text(RING)
    return tmp_path / "ring.toml"


@pytest.fixture
def design(ring):
    return gc.open(ring)


def test_tip_diameters_stand_for_tip_alterations(design):
    other = replace(design, tip_alteration=0.0, tip_diameter=design.geometry.tip_diameter)
    assert other.geometry.tip_alteration == pytest.approx((0, -0.4e-3), abs=1e-15)
    assert replace(design, centre_distance="61.5 mm").geometry == design.geometry


def test_a_relief_begins_on_either_wheel_where_single_contact_ends(design):
    """From there to each tip is what the path has beyond one base pitch; the ring's tip is its inner circle."""
    geometry = design.geometry
    starts, tips = geometry.single_contact_diameter, geometry.tip_diameter
    assert starts[0] < tips[0] and starts[1] > tips[1]
    relief = replace(design, load_sharing=None, tip_relief={"amount": "9 um", "start_diameter": starts}).path_relief
    assert relief.length == pytest.approx([geometry.path_of_contact - geometry.base_pitch] * 2, rel=1e-12)
    with pytest.raises(gc.InputError, match="greater than the tip diameter"):
        replace(design, load_sharing=None, tip_relief={"amount": (0, "9 um"), "start_diameter": tips})


def test_the_root_stress_is_that_of_the_pinion(design):
    """That of an external pair with the same pinion and contact ratio: with the load at the same point of the tooth."""
    own = design.geometry

    def external(k):
        return Geometry(teeth=own.teeth, normal_module=own.normal_module, pressure_angle=own.pressure_angle,
                        helix_angle=0.0, profile_shift=own.profile_shift, centre_distance=own.normal_module * 81 / 2,
                        face_width=own.face_width, tip_alteration=(0.0, k))

    k = brentq(lambda k: external(k).contact_ratio - own.contact_ratio, -2e-3, 2e-3, xtol=1e-15)
    found, other = root_factors(own), root_factors(external(k))
    for name in ("root_form_factor", "root_stress_correction"):
        value, = getattr(found, name)
        assert value == pytest.approx(getattr(other, name)[0], rel=1e-9)


def test_the_datasheet_leaves_out_what_a_ring_has_not(design):
    entries = datasheet(design)
    alone = {name for name, entry in entries.items() if isinstance(entry.value, tuple) and len(entry.value) == 1}
    assert alone == {"root_form_diameter", "undercut_shift", "virtual_teeth", "root_form_factor",
                     "root_stress_correction", "root_stress"}
    assert math.isfinite(json.loads(json.dumps(entries["virtual_teeth"].value, allow_nan=False))[0])
    assert {name for name, entry in entries.items() if entry.value is None and not entry.expected} == {"masses"}
    assert "A ring is no disc" in entries["masses"].reason
    assert "A ring is no disc" in datasheet(replace(design, inertia=None, mass=1.0))["inertias"].reason
    assert all(entries[name].value > 1 for name in ("Kv_ISO_B", "Kv_ISO_C", "Kv_AGMA"))


def test_words_say_that_it_is_a_ring(design, ring):
    text = ask("gear", ring, "--speed", "2000:2400:2", code=0).stdout
    assert "Internal spur pair 20/61, module 3 mm" in text and "ISO 6336-1, the ring as a rack" in text
    assert "Root stresses are those of the pinion." in " ".join(design.assumptions)
    assert inputs_in_words(design)["teeth"] == "20 / 61, wheel 2 a ring"
    assert "Gear design: internal spur gears, 20 and 61 teeth" in design._repr_html_()


def test_studies_take_it_alone_and_as_the_mesh_of_a_train(design, ring):
    (ring.parent / "train.toml").write_text(TRAIN)
    train = gc.open(ring.parent / "train.toml")
    assert train.meshes[0].internal and train.speeds["ring"] == pytest.approx(3000 * 20 / 61)
    with pytest.raises(gc.InputError, match="internal must be left out or as in the design"):
        gc.Mesh(between=("pinion", "ring"), design=design, internal=False)
    pair = gc.regime(design)
    assert pair.label == "1T" and pair.contact == "permanent"
    there = gc.regime(train).meshes["pinion/ring"]
    assert there["force_peak"] == pytest.approx(pair.dynamic_factor * 60 / (
        design.geometry.base_diameter[0] / 2), rel=1e-6)
    found = gc.operating_map(design, gc.Axis("speed", 2500, 3000, 2), gc.Axis("torque", 60, 80, 2))
    assert float(found.dynamic_factor.sel(speed=3000, torque=60)) == pytest.approx(pair.dynamic_factor, rel=1e-6)
    assert run_json("regime", ring)["label"] == "1T"


def test_results_know_their_ring(design):
    assert gears_from_json(gears_json(design)) == design


def test_the_picture_has_the_pinion_in_the_ring(design):
    section = transverse_section(design)
    (own, ring), (r, outer) = section.centres, section.outer_radii
    assert ring - own == pytest.approx([0, -61.5e-3], abs=1e-12) and outer - r > 61.5e-3
    assert outer == pytest.approx(design.geometry.root_diameter[1] / 2 + RIM * 3e-3, rel=1e-12)
    whole = gc.plot.gear_pair(design, teeth=None)
    arrows = [np.column_stack(line.get_data()) for line in whole.lines if 20 < len(line.get_xdata()) < 40]
    assert len(arrows) == 2 and all(arrow[-1, 1] > arrow[0, 1] for arrow in arrows)  # at the left, upwards: clockwise
    assert np.hypot(*arrows[0].T).max() < 30  # that of the pinion on it, where no ring is
    top, bottom = whole.get_ylim()[1], whole.get_ylim()[0]
    assert top > 1e3 * (ring[1] + outer) and bottom < 1e3 * (ring[1] - outer)
    material = whole.patches[1].get_xy()
    inside, outside = (Path(each) for each in np.split(material, np.flatnonzero(np.isnan(material[:, 0])))[:2])
    points = 1e3 * np.array([own, ring, ring + np.array([0, outer - 1e-3])])
    assert inside.contains_points(points).tolist() == [True, True, False]
    assert Path(outside.vertices[1:]).contains_points(points).all()
    close = gc.plot.gear_pair(design).child_axes[0]
    assert [text.get_text() for text in close.texts] == ["A", "E", "C"]


def test_the_explorer_opens_it_without_the_form_of_a_drawing(design, ring):
    assert gears_of(study_view(load_study(ring)).operating_point) == design
    assert Drawing.of_study(tomllib.loads(RING)) is None


def test_teeth_that_differ_turn_in_a_train_whose_wheels_turn_the_same_way(design):
    train = replace(design, faults=[{"wheel": 2, "tooth": 5, "stiffness_loss": 0.3}]).to_train()
    assert train.meshes[0].internal and train.speeds["wheel2"] == pytest.approx(3000 * 20 / 61)
