"""A gear design as a value: forms of its inputs, every refusal with its question, warnings, the tables of a file."""

import pickle
from dataclasses import asdict, replace
from functools import cached_property

import numpy as np
import pytest

from gearchaos.errors import InputError
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.design.values import ErrorTable, OrdersFile, Rack, ReliefDimensions, Supports, TableFile
from gearchaos.gears.geometry.backlash import OF, Backlash, ThicknessAllowances
from gearchaos.gears.geometry.dimensions import DESIGN_FORMULAS, GEOMETRY_FORMULAS, Geometry
from gearchaos.gears.geometry.mechanics import STEEL, Material
from gearchaos.gears.transmission_error import Quality

SMALL = {"teeth": (20, 40), "module": 3e-3, "face_width": 0.03}

SHA256 = "0" * 64
"""The checksum of a table that the tests of the inputs do not read."""

FULL = {
    "teeth": [17, 103], "module": "8 mm", "pressure_angle": "20 deg", "helix_angle": "15.8 deg",
    "face_width": ["100 mm", "98 mm"], "centre_distance": "500 mm", "profile_shift": [0.145, 0.0],
    "rack": {"addendum": 1.0, "dedendum": 1.4, "root_radius": 0.39}, "tip_diameter": ["159.66 mm", "872.35 mm"],
    "tip_relief": {"amount": "70 um", "start_diameter": ["155 mm", "868 mm"]},
    "material": ["steel", {"E": "173 GPa", "poisson": 0.3, "density": "7100 kg/m^3"}],
    "bore": ["30 mm", "60 mm"], "quality": {"standard": "ISO 1328-1:1995", "grade": [5, 6]},
    "backlash": {"value": "0.12 mm", "of": "line of action, total"}, "damping_ratio": 0.05,
    "stiffness": {"table": "tvms.csv", "sha256": SHA256},
    "transmission_error": {"orders": "te.csv", "sha256": SHA256}, "eccentricity": ["5 um", "20 um"],
    "supports": {"stiffness": ["200 N/um", "300 N/um"], "damping_ratio": [0.02, 0.03]},
}
OPERATION = {"speed": "360 rpm", "torque": "9000 N*m", "application_factor": 1.25}


def design(**changes):
    return GearDesign(**{**SMALL, **changes})


def test_values_are_kept_in_si_and_per_wheel():
    full = GearDesign.from_tables(FULL, OPERATION)
    assert full.module == 8e-3 and full.face_width == (0.1, 0.098) and full.centre_distance == 0.5
    assert full.helix_angle == pytest.approx(np.radians(15.8), rel=1e-15)
    assert full.rack == Rack(addendum=1.0, dedendum=1.4, root_radius=0.39)
    assert full.tip_relief == ReliefDimensions(amount="70 um", start_diameter=(0.155, 0.868))
    assert full.material == (STEEL, Material(E=173e9, poisson=0.3, density=7100.0))
    assert full.quality == Quality("ISO 1328-1:1995", (5, 6))
    assert full.backlash == Backlash(value=0.12e-3, of="line of action, total")
    assert full.stiffness == TableFile(table="tvms.csv", sha256=SHA256)
    assert full.transmission_error == OrdersFile(orders="te.csv", sha256=SHA256)
    assert full.eccentricity == pytest.approx((5e-6, 20e-6), rel=1e-15)
    assert full.supports == Supports(stiffness=(2e8, 3e8), damping_ratio=(0.02, 0.03))
    assert full.speed == 360 and (full.torque, full.application_factor) == (9000.0, 1.25)
    assert GearDesign.from_tables({**SMALL, "application_factor": 1.5}).application_factor == 1.5  # in either table


def test_one_value_stands_for_both_wheels_and_defaults_are_the_documented_ones():
    small = design(bore="10 mm", tip_alteration="-0.1 mm", tip_relief="10 um")
    assert small.face_width == (0.03, 0.03) and small.bore == (0.01, 0.01) and small.tip_alteration == (-1e-4, -1e-4)
    assert small.tip_relief.amount == pytest.approx((1e-5, 1e-5), rel=1e-15)
    plain = design()
    assert plain.pressure_angle == pytest.approx(np.pi / 9, rel=1e-15) and plain.helix_angle == 0.0
    assert plain.rack == Rack(addendum=1.0, dedendum=1.25, root_radius=0.38)
    assert plain.material == (STEEL, STEEL) and (STEEL.E, STEEL.poisson, STEEL.density) == (206e9, 0.3, 7830.0)
    assert (plain.stiffness, plain.transmission_error, plain.application_factor) == ("ISO 6336-1", None, 1.0)
    assert plain.eccentricity == plain.tip_alteration == (0.0, 0.0)
    assert {name for name, value in asdict(plain).items() if value is None} >= {
        "centre_distance", "profile_shift", "bore", "inertia", "mass", "quality", "backlash", "damping_ratio",
        "supports", "speed", "torque", "tip_relief", "tip_diameter", "transmission_error"}


@pytest.mark.parametrize(("name", "forms"), [
    ("module", [3e-3, "3 mm", "0.3 cm", np.float64(3e-3)]),
    ("face_width", [0.03, "30 mm", [0.03, "3 cm"], np.array([0.03, 0.03])]), ("pressure_angle", [np.pi / 9, "20 deg"]),
    ("centre_distance", [0.09, "90 mm"]), ("teeth", [(20, 40), [20, 40], np.array([20, 40])]),
    ("material", ["steel", STEEL, [STEEL, "steel"], {"E": "206 GPa", "poisson": 0.3, "density": 7830}]),
    ("rack", [{}, {"addendum": 1}, Rack(), {"root_radius": 0.38, "dedendum": 1.25}]),
    ("transmission_error", [{"table": "e.csv", "sha256": SHA256}, ErrorTable(table="e.csv", sha256=SHA256)]),
    ("backlash", [{"value": "100 um", "of": "normal, total"}, Backlash(value="100 um", of="normal, total")]),
    ("inertia", [1e-3, "1e-3 kg*m^2", "10 kg*cm^2"]),
    ("supports", [{"stiffness": "100 N/um", "damping_ratio": 0.02}, Supports(stiffness=1e8, damping_ratio=0.02)]),
    ("speed", ["3000 rpm", 3000, "50 turn/s"]), ("helix_angle", ["10 deg", "-10 deg"]),
])
def test_forms_of_one_value_make_equal_designs(name, forms):
    expected, *others = (getattr(design(**{name: form}), name) for form in forms)
    assert all(got == expected or got == pytest.approx(expected, rel=1e-15) for got in others)


def test_pint_quantities_are_taken():
    registry = pytest.importorskip("pint").UnitRegistry()
    quantities = {"module": registry.Quantity(3, "mm"), "face_width": registry.Quantity([30, 30], "mm"),
                  "inertia": [registry.Quantity(1, "g*m^2"), "1e-3 kg*m^2"]}
    assert design(**quantities) == design(module="3 mm", face_width="30 mm", inertia=1e-3)
    with pytest.raises(InputError, match=r"module must be a length; got '3 kilogram'\.") as refusal:
        design(module=registry.Quantity(3, "kg"))
    assert refusal.value.value == "3 kilogram"


ALLOWANCES = {"tooth_thickness_allowances": [["-70 um", "-110 um"], ["-100 um", "-150 um"]], "plane": "transverse",
              "centre_distance_allowance": "20 um", "at": "minimum"}


@pytest.mark.parametrize("full", [
    GearDesign.from_tables(FULL, OPERATION), design(), design(tip_alteration="keep clearance"),
    design(backlash=ALLOWANCES, stiffness="potential energy", transmission_error="from quality", mass=[1, 2]),
])
def test_designs_are_values(full):
    again = GearDesign(**asdict(full))
    assert again == full == pickle.loads(pickle.dumps(full)) and hash(again) == hash(full)
    assert again.geometry == full.geometry and replace(full, face_width=0.05).geometry.common_face_width == 0.05
    assert full != replace(full, face_width="99 mm")


RING = {"teeth": [20, 61], "internal": True, "profile_shift": [0.2, -0.2], "tip_alteration": [0, "-0.4 mm"]}
REFUSED = [
    ({"internal": "yes"}, "internal", "must be true or false"),
    ({"internal": True, "teeth": [61, 20]}, "teeth", "the ring second", "Wheel 1, the pinion, drives"),
    ({**RING, "bore": "10 mm"}, "bore", "beside internal", "Give inertia"),
    ({**RING, "blank": ["solid", {"rim": "9 mm", "web": "9 mm"}]}, "blank[1]", "counts as rigid"),
    ({**RING, "stiffness": "potential energy"}, "stiffness", "that of its cutter", 'stiffness = "ISO 6336-1", or',
     "table"),
    ({**RING, "faults": [{"wheel": 1, "tooth": 3, "crack_depth": "1 mm"}]}, "faults", "give stiffness_loss"),
    ({"internal": True, "teeth": [20, 61]}, "start_of_active_profile[0]", "The ring clears it with a tip_diameter"),
    ({**RING, "tip_alteration": [0, "3 mm"]}, "start_of_active_profile[0]", "a contact below the base circle"),
    ({**RING, "centre_distance": "55 mm"}, "centre_distance", "greater than 57.79", "the difference of the base radii"),
    ({**RING, "tip_alteration": ["0.8 mm", "-0.4 mm"]}, "tip_clearance[0]", "touches the root of wheel 2"),
    ({**RING, "centre_distance": "41 mm"}, "centre_distance", "Without profile shift it is 61.5 mm"),
    ({**RING, "profile_shift": [0.9, 0.3]}, "profile_shift", "must have a sum below 0.8395", "too thick"),
    ({**RING, "tip_relief": {"amount": "9 um", "start_diameter": ["65 mm", "178 mm"]}}, "tip_relief.start_diameter[1]",
     "must lie between 179"),
    # slips of units
    ({"module": 3}, "module", "did you mean '3 mm'? a plain number is in m.", "got 3000 mm"),
    ({"module": 3e-6}, "module", "between 0.01 and 100 mm; got 0.003 mm"),
    ({"face_width": 30}, "face_width[0]", "did you mean '30 mm'"),
    ({"helix_angle": 15.8}, "helix_angle", "did you mean '15.8 deg'"),
    ({"centre_distance": 90}, "centre_distance", "did you mean '90 mm'"),
    ({"tip_alteration": [0, 0.1]}, "tip_alteration[1]", "did you mean '0.1 mm'"),
    ({"tip_diameter": [66, 126]}, "tip_diameter[0]", "did you mean '66 mm'"),
    ({"tip_diameter": ["73 mm", "126 mm"]}, "tip_diameter[0]", "nominal tip diameter is 66 mm", "60 and 72 mm"),
    ({"bore": [0.01, 20]}, "bore[1]", "did you mean '20 mm'"), ({"bore": "51 mm"}, "bore[0]", "half a module"),
    ({"backlash": {"value": 0.12, "of": "line of action, total"}}, "backlash.value", "did you mean '0.12 mm'"),
    ({"backlash": {"tooth_thickness_allowances": [-0.07, -0.11]}}, "backlash", "half a module"),
    ({"eccentricity": 0.02}, "eccentricity[0]", "did you mean '0.02 mm'"),
    ({"tip_relief": 20}, "tip_relief.amount[0]", "did you mean '20 um'"),
    ({"tip_relief": {"amount": 1e-5, "start_diameter": [65, 125]}}, "tip_relief.start_diameter[0]", "'65 mm'"),
    ({"material": {"E": 206e3, "poisson": 0.3, "density": 7830}}, "material.E", "did you mean '206000 MPa'"),
    ({"material": {"E": 206, "poisson": 0.3, "density": 7830}}, "material.E", "did you mean '206 GPa'"),
    ({"material": ["steel", {"E": 206e9, "poisson": 0.3, "density": 7.8}]}, "material[1].density", "'7.8 g/cm^3'"),
    ({"supports": {"stiffness": 200, "damping_ratio": 0}}, "supports.stiffness", "did you mean '200 N/um'"),
    ({"speed": "60 Hz"}, "speed", "Hertz"),
    # wrong forms
    ({"teeth": 20}, "teeth", "a list of two"),
    ({"teeth": [20, 40, 60]}, "teeth", "a list of two"), ({"teeth": [20, 40.5]}, "teeth[1]", "a whole number"),
    ({"teeth": [20, 2]}, "teeth[1]", "at least 3"), ({"teeth": [20, -60]}, "teeth[1]", "internal = true"),
    ({"module": "3"}, "module", "a length"), ({"module": -3e-3}, "module", "greater than 0"),
    ({"module": None}, "module", "or give diametral_pitch", "must be given"),
    ({"diametral_pitch": 8}, "diametral_pitch", "must be left out beside module"),
    ({"module": None, "diametral_pitch": "8 mm"}, "diametral_pitch", "8 1/in", "must be a diametral pitch"),
    ({"module": None, "diametral_pitch": 0.1}, "module", "between 0.0003937 and 3.937 in"),
    ({"blank": "disc"}, "blank", "rim = '70 mm'", "must be 'solid', or a table with rim and web"),
    ({"blank": {"rim": "8 mm"}}, "blank", "rim = '70 mm'", "a table with rim and web"),
    ({"blank": ["solid", {"rim": "8 mm", "web": 9}]}, "blank[1].web", "did you mean '9 mm'", "between 0.3 and 60 mm"),
    ({"blank": {"rim": "60 mm", "web": "9 mm"}}, "blank[0].rim", "root circle", "between 0.3 and"),
    ({"profile_shift": 0.1}, "profile_shift", "a list of two"),
    ({"profile_shift": ["x", 0]}, "profile_shift[0]", "a number"), ({"rack": 1.25}, "rack", "a table with addendum"),
    ({"rack": {"adendum": 1}}, "rack", "did you mean 'addendum'", "no key but"),
    ({"rack": {"addendum": 0}}, "rack.addendum", "greater than 0"),
    ({"rack": {"root_radius": -0.1}}, "rack.root_radius", "not be negative"),
    ({"material": "stel"}, "material", "did you mean 'steel'"),
    ({"material": "PEEK"}, "material", "a table: material = { E = '3 GPa', poisson = 0.4,", "one of PA66, PA66 dry"),
    ({"material": 206e9}, "material", "'steel'", "a name or a table"),
    ({"material": {"E": 206e9, "poisson": 0.3}}, "material.density", "must be given"),
    ({"material": {"E": 206e9, "poisson": 0.5, "density": 7830}}, "material.poisson", "less than 0.5"),
    ({"bore": -0.01}, "bore", "not be negative"), ({"inertia": 0}, "inertia", "greater than 0"),
    ({"mass": [1, -1]}, "mass[1]", "greater than 0"), ({"quality": 5}, "quality", "grade = 5", "standard and grade"),
    ({"quality": {"standard": "ISO 1328-1:1995", "grade": 6, "deviation": [0, 1]}}, "quality", "and deviations if"),
    ({"quality": {"standard": "ISO 1328-1:1995", "grade": 6, "deviations": 1}}, "quality.deviations", "list of two"),
    ({"quality": {"standard": "ISO 1328-1:1995", "grade": 6, "deviations": [1, "a"]}}, "quality.deviations[1]",
     "number"),
    ({"quality": {"standard": "ISO 1328-1:1995", "grade": 6, "deviations": [-1.1, 1]}}, "quality.deviations[0]",
     "coarser grade", "in [-1, 1]"),
    ({"quality": {"standard": "ISO 1328-1:1995", "grade": 6, "deviations": [0, 1]}}, "quality.deviations",
     "They make the error", 'unless transmission_error = "from quality"'),
    ({"backlash": "0.12 mm"}, "backlash", "line of action, total", "what it is of"),
    ({"backlash": {"value": "0.12 mm"}}, "backlash.of", "must be given"),
    ({"backlash": {"value": "0.12 mm", "of": "line of acton"}}, "backlash.of", "did you mean 'line of action'?",
     "'normal', 'radial', 'angle of wheel 1', 'angle of wheel 2', alone or followed by"),
    ({"backlash": {"value": "0.12 mm", "of": "tangential"}}, "backlash.of", "did you mean 'circumferential'?"),
    ({"backlash": {"value": "0.12 mm", "of": "pitch circle"}}, "backlash.of", "did you mean 'circumferential'?"),
    ({"backlash": {"value": "6 arcmin", "of": "radial"}}, "backlash.value", "of = 'angle of wheel 1' takes an angle",
     "must be a length"),
    ({"backlash": {"value": "6 mm", "of": "angle of wheel 2"}}, "backlash.value", "it is an angle", "must be an angle"),
    ({"backlash": {"value": "0.12 mm", "of": "half radial"}}, "backlash.of", "did you mean", "or by ', half'"),
    ({"backlash": {"value": 0, "of": "normal, total"}}, "backlash.value", "greater than 0"),
    ({"backlash": {**ALLOWANCES, "plane": "axial"}}, "backlash.plane", "one of normal, transverse"),
    ({"backlash": {**ALLOWANCES, "at": "mode"}}, "backlash.at", "one of maximum, mean"),
    ({"backlash": {**ALLOWANCES, "tooth_thickness_allowances": "-70 um"}}, "backlash.tooth_thickness_allowances",
     "[['-70 um'", "a list of upper and lower"),
    ({"backlash": {**ALLOWANCES, "tooth_thickness_allowances": [["1 um", "-1 um"], ["-1 um", "-2 um"]]}},
     "backlash.tooth_thickness_allowances[0][0]", "not be greater than 0"),
    ({"backlash": {**ALLOWANCES, "tooth_thickness_allowances": [["-1 um", "-2 um"], ["-3 um", "-2 um"]]}},
     "backlash.tooth_thickness_allowances[1]", "upper allowance first"),
    ({"backlash": {**ALLOWANCES, "tooth_thickness_allowances": [["-1 um", "-2 um"], "-3 um"]}},
     "backlash.tooth_thickness_allowances[1]", "a list of upper and lower"),
    ({"backlash": {**ALLOWANCES, "centre_distance_allowance": ["-1 um", "1 um"]}}, "backlash.centre_distance_allowance",
     "upper allowance first"),
    ({"backlash": {**ALLOWANCES, "centre_distance_allowance": "-20 um"}}, "backlash.centre_distance_allowance",
     "not be negative"),
    ({"backlash": {"tooth_thickness_allowances": [0, 0]}}, "backlash", "no backlash", "greater than 0"),
    ({"damping_ratio": 5}, "damping_ratio", "not a percentage", "less than 1"),
    ({"damping_ratio": 0}, "damping_ratio", "greater than 0"),
    ({"stiffness": "iso"}, "stiffness", "{ table = '…' }", "one of ISO 6336-1, potential energy"),
    ({"stiffness": {"orders": "c.csv"}}, "stiffness", "must be ISO 6336-1 or potential energy or { table"),
    ({"stiffness": {"table": 5}}, "stiffness.table", "the path of a file"),
    ({"stiffness": {"table": "no.csv"}}, "stiffness.table", "a file that can be read; got 'no.csv'"),
    ({"transmission_error": {"table": "no.csv"}}, "transmission_error.table", "a file that can be read; got 'no.csv'"),
    ({"transmission_error": {"orders": "no.csv"}}, "transmission_error.orders", "a file that can be read"),
    ({"transmission_error": "quality"}, "transmission_error", "did you mean 'from quality'"),
    ({"transmission_error": {"orders": "a", "table": "b"}}, "transmission_error", "{ orders = '…' } or { table"),
    ({"eccentricity": -1e-6}, "eccentricity", "not be negative"),
    ({"tip_relief": {"amount": 1e-5, "shape": "round"}}, "tip_relief.shape", "linear, parabolic"),
    ({"supports": {"stiffness": 1e8, "damping_ratio": 1}}, "supports.damping_ratio", "less than 1"),
    ({"application_factor": 0}, "application_factor", "greater than 0"), ({"torque": -1}, "torque", "not be negative"),
    # dimensions that contradict each other, and pairs that cannot run
    ({"centre_distance": "92 mm"}, "profile_shift", "split this sum", "with a sum of 0.718705"),
    ({"centre_distance": "84 mm", "profile_shift": [0, 0]}, "centre_distance", "is 90 mm",
     "greater than 84.5723359 mm, the sum of the base radii; got 84 mm"),
    ({"centre_distance": "90 mm", "profile_shift": [0.1, 0.05]}, "profile_shift", "leave out centre_distance",
     "a sum of at most "),
    ({"centre_distance": "92 mm", "profile_shift": [0, 0], "backlash": {"value": "0.5 mm", "of": OF[0]}},
     "backlash.value", "total or half", "at least the 1.475 mm"),
    ({"teeth": [7, 8], "profile_shift": [-0.5, -0.5]}, "profile_shift", "thin", "a sum above -0.307"),
    ({"tip_alteration": -1e-4, "tip_diameter": [0.066, 0.126]}, "tip_alteration",
     "left out beside tip_diameter; got (-0.1 mm, -0.1 mm)"),
    ({"rack": {"dedendum": 2.2}}, "rack.dedendum", "intersect", "less than 2.158"),
    ({"rack": {"root_radius": 0.5}}, "rack.root_radius", "at most 0.4719"),
    ({"rack": {"dedendum": 0.2, "root_radius": 0.38}}, "rack.root_radius", "at most 0.304"),
    ({"teeth": [3, 40], "profile_shift": [-0.3, 0.3]}, "tip_diameter[0]", "greater than those of the base circle"),
    ({"teeth": [8, 40], "profile_shift": [0.9, 0]}, "tip_thickness[0]", "tip_alteration",
     "greater than 0; got -1.29749755 mm"),
    ({"teeth": [40, 8], "profile_shift": [0, 0.9]}, "tip_thickness[1]", "tip_alteration", "greater than 0"),
    ({"profile_shift": [1.0, 1.2]}, "tip_clearance[0]", "the tip of wheel 1 touches the root of wheel 2", "than 0"),
    ({"teeth": [12, 40]}, "start_of_active_profile[0]", "undercut profile_shift[0] is at least 0.2981", "form"),
    ({"teeth": [40, 12]}, "start_of_active_profile[1]", "Give wheel 2 a larger profile_shift", "form diameter"),
    ({"teeth": [40, 12]}, "start_of_active_profile[1]", "The tip of wheel 1 meets the root of wheel 2", "form"),
    ({"rack": {"root_radius": 0.47, "addendum": 1.2}}, "start_of_active_profile[0]", "no involute",
     "form diameter, 56.5245323 mm; got 56.4464157 mm"),
    ({"tip_alteration": [0, "0.5 mm"]}, "tip_diameter[1]", "enters the root fillet of wheel 1, by 22.5",
     "126.879898 mm"),
    ({"teeth": [40, 20], "tip_alteration": ["0.5 mm", 0]}, "tip_diameter[0]", "shorten the teeth of wheel 1",
     "must be at most 126.879898 mm"),
    ({"rack": {"addendum": 0.5}}, "contact_ratio", "smaller centre_distance", "at least 1"),
]


def test_a_ring_needs_inertias_and_with_supports_masses():
    ring = design(**RING, damping_ratio=0.05, backlash={"value": "0.1 mm", "of": "radial"}, speed=600, torque=10)
    with pytest.raises(InputError, match=r"inertia must be given.*A ring is no disc"):
        ring.to_pair()
    supports = {"stiffness": 1e8, "damping_ratio": 0.05}
    with pytest.raises(InputError, match=r"mass must be given.*A ring is no disc"):
        replace(ring, inertia=1e-3, supports=supports).to_pair()
    assert replace(ring, inertia=1e-3, mass=1.0, supports=supports).to_pair().I2 == 1e-3
    assert "up to 189.09 mm in diameter" in " ".join(ring.assumptions)


@pytest.mark.parametrize("case", REFUSED, ids=lambda case: str(case)[1:60])
def test_refusals_name_the_field_the_rule_and_what_to_do(case):
    changes, field, *words = case
    with pytest.raises(InputError) as refusal:
        design(**changes)
    text = str(refusal.value)
    assert refusal.value.field == field and all(each.lower() in text.lower() for each in words), text
    assert text.endswith((".", "?")) and "  " not in text
    assert str(pickle.loads(pickle.dumps(refusal.value))) == text


@pytest.mark.parametrize(("field", "read"), [
    ("backlash", lambda d: d.backlash_line_of_action), ("bore", lambda d: d.masses), ("bore", lambda d: d.inertias),
    ("bore", lambda d: d.equivalent_mass), ("speed", lambda d: d.load), ("torque", lambda d: d.at(speed=100.0).load),
    ("damping_ratio", lambda d: d.given("damping_ratio")), ("tip_relief.start_diameter", lambda d: d.path_relief)])
def test_inputs_that_a_result_needs_are_asked_for(field, read):
    with pytest.raises(InputError, match=f"^{field} must be given") as refusal:
        read(design(tip_relief="10 um"))
    assert refusal.value.advice and ("0.03 to 0.1" in refusal.value.advice) is (field == "damping_ratio")
    assert design(damping_ratio=0.04).given("damping_ratio") == 0.04


def test_all_inputs_that_a_model_lacks_are_asked_for_at_once():
    with pytest.raises(InputError, match=r"^bore, backlash, damping_ratio, speed and torque must be given") as refusal:
        design().to_model()
    for advice in ("0 for a disc without one", "backlash = {", "0.03 to 0.1", "'360 rpm'", "'9000 N*m'"):
        assert advice in refusal.value.advice
    given = {"backlash": {"value": "0.1 mm", "of": "line of action"}, "damping_ratio": 0.05, "speed": 100, "torque": 50}
    for complete in ({"inertia": [1e-3, 1e-2]}, {"mass": [1, 2]}):
        assert design(**given, **complete).to_model().omega > 0
    supports = {"stiffness": "200 N/um", "damping_ratio": 0.02}
    for more, missing in (({"transmission_error": "from quality"}, "quality and bore"),
                          ({"inertia": [1e-3, 1e-2], "supports": supports}, "bore"),
                          ({"mass": [1, 2], "stiffness": "potential energy"}, "bore")):
        with pytest.raises(InputError, match=f"^{missing} must be given"):
            design(**given, **more).to_model()


@pytest.mark.parametrize(("changes", "words"), [
    ({"teeth": [16, 20]}, "The teeth of wheel 1 are undercut: profile_shift[0] is 0"),
    ({"teeth": [20, 16]}, "The teeth of wheel 2 are undercut"),
    ({"teeth": [10, 40], "profile_shift": [0.65, 0]}, "The teeth of wheel 1 are 0.1552 mm thick at the tip"),
    ({"tip_alteration": ["0.5 mm", 0]}, "Between the tip of wheel 1 and the root of wheel 2 there are 0.25 mm"),
    ({"centre_distance": "90.5 mm", "profile_shift": [0, 0]}, "would have the sum 0.1701 at this centre distance"),
    ({"tip_alteration": "0.5 mm", "rack": {"root_radius": 0.2}},
     "Between the tip of wheel 2 and the root of wheel 1 there are 0.25 mm"),
    ({"damping_ratio": 0.01}, "damping_ratio is 0.01; usual are 0.03 to 0.1."),
    ({"damping_ratio": 0.2}, "damping_ratio is 0.2"), ({"speed": 20_100}, "m/s at 20100 rpm, unusually high."),
    ({"speed": "2100 rad/s"}, "The pitch line velocity is 63 m/s"),
    ({"torque": 9000}, "The load F_t/(b m_n) is 3333 N/mm²"), ({"inertia": [5, 8]}, "inertia[0] is"),
    ({"mass": 700}, "mass[0] is"), ({"inertia": ["1 g*cm^2", "10 kg*cm^2"]}, "inertia[0] is"),
    ({"inertia": ["1 kg*cm^2", "20 kg*m^2"]}, "times that of a solid disc of the size of wheel 2"),
])
def test_unusual_values_make_warnings(changes, words):
    found = design(**changes).warnings
    assert any(words in sentence for sentence in found), found
    assert all(sentence.endswith((".", "?")) for sentence in found)
    assert ("is it in kg?" in str(found)) is ("mass" in changes)


def test_an_ordinary_design_has_no_warnings():
    assert design().warnings == design(mass=("0.3 kg", "0.7 kg")).warnings == ()
    assert design(damping_ratio=0.05, speed="3000 rpm", torque="100 N*m", inertia=["10 kg*cm^2", "100 kg*cm^2"],
                  backlash={"value": "0.1 mm", "of": "line of action, total"}).warnings == ()


def test_allowances_and_values_are_both_backlash():
    both = design(backlash={"tooth_thickness_allowances": ["-70 um", "-110 um"]}).backlash
    assert isinstance(both, ThicknessAllowances)
    assert both.tooth_thickness_allowances == (pytest.approx((-70e-6, -110e-6), rel=1e-14),) * 2
    assert (both.plane, both.at, both.centre_distance_allowance) == ("normal", "mean", (0.0, 0.0))


@pytest.mark.parametrize(("tables", "field", "words"), [
    (({**SMALL, "modul": 1}, {}), "[design]", "Did you mean 'module'"),
    (({**SMALL, "speed": 1}, {}), "[design]", "must have no key but"),
    ((SMALL, {"spede": 1}), "[operation]", "Did you mean 'speed'"),
    (({"teeth": [20, 40], "module": "3 mm"}, None), "face_width", "must be given in [design]"),
    (({"teeth": [20, 40]}, None), "module and face_width", "must be given in [design]"),
    (({**SMALL, "application_factor": 1.5}, {"application_factor": 1.25}), "application_factor", "one table only"),
])
def test_tables_with_wrong_names_are_refused(tables, field, words):
    with pytest.raises(InputError) as refusal:
        GearDesign.from_tables(*tables)
    assert refusal.value.field == field and words in str(refusal.value)


def test_every_computed_value_has_a_symbol_a_unit_a_formula_and_a_source():
    full = GearDesign.from_tables({**FULL, "supports": {"stiffness": 1e8, "damping_ratio": 0}}, OPERATION)
    for owner, described in ((full.geometry, GEOMETRY_FORMULAS), (full, DESIGN_FORMULAS)):
        for name, formula in described.items():
            assert np.isfinite(np.multiply(getattr(owner, name), formula.factor)).all(), name
            assert formula.symbol and formula.text and formula.source, name
    computed = {name for name, value in vars(Geometry).items() if isinstance(value, (property, cached_property))}
    assert computed - set(GEOMETRY_FORMULAS) == {
        "common_face_width", "least_contact", "single_contact_diameter", "tangent_length", "tip_tangents"}
    assert GEOMETRY_FORMULAS["working_pressure_angle"].factor * full.geometry.working_pressure_angle == pytest.approx(
        21.0661, abs=5e-5)
