"""Any design is either made or refused with an `InputError`; what is made has finite dimensions."""

import math

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gearchaos.errors import InputError
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.geometry.backlash import OF
from gearchaos.gears.geometry.dimensions import GEOMETRY_FORMULAS


def two(values):
    """A value of each wheel."""
    return st.tuples(values, values)


# lengths in modules
required = {"teeth": two(st.integers(3, 200)), "face_width": two(st.floats(0.05, 60))}
lengths = {
    "tip_alteration": two(st.floats(-0.5, 0.2)), "bore": two(st.floats(0, 30)), "eccentricity": two(st.floats(0, 0.1)),
}
optional = {
    "pressure_angle": st.floats(0.1, 0.7), "helix_angle": st.floats(-1.0, 1.0),
    "profile_shift": two(st.floats(-3, 3) | st.floats(0, 0.5)), "torque": st.floats(0, 1e6),
    "rack": st.fixed_dictionaries({}, optional={
        "addendum": st.floats(0.1, 2), "dedendum": st.floats(0.1, 2), "root_radius": st.floats(0, 0.5)}),
    "speed": st.floats(1, 1e4), "inertia": two(st.floats(1e-9, 1e3)), "damping_ratio": st.floats(0.001, 1),
}
allowances = two(st.floats(-0.1, 0.0)).map(lambda pair: tuple(sorted(pair, reverse=True)))
backlashes = st.none() | st.builds(dict, value=st.floats(0, 0.5), of=st.sampled_from(OF)) | st.builds(
    dict, tooth_thickness_allowances=two(allowances), centre_distance_allowance=st.floats(0, 0.02),
    at=st.sampled_from(["minimum", "mean", "maximum"]))


def in_metres(value, module):
    """A number, or the numbers in tuples and in the values of a dict, times the module; texts stay as they are."""
    if isinstance(value, dict):
        return {name: in_metres(item, module) for name, item in value.items()}
    if isinstance(value, tuple):
        return tuple(in_metres(item, module) for item in value)
    return value if isinstance(value, str) else value * module


@settings(max_examples=400, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(st.fixed_dictionaries(required, optional=optional), st.fixed_dictionaries({}, optional=lengths), backlashes,
       st.floats(2e-4, 3e-2), st.none() | st.floats(0.95, 1.1))
def test_any_design_is_made_or_refused(values, relative_lengths, backlash, module, relative):
    values = {**values, "module": module, **in_metres(relative_lengths, module),
              "face_width": in_metres(values["face_width"], module)}
    if backlash is not None:
        values["backlash"] = in_metres(backlash, module)
    if relative is not None:
        values["centre_distance"] = relative * module / math.cos(values.get("helix_angle", 0.0)) * sum(
            values["teeth"]) / 2
    try:
        design = GearDesign(**values)
    except InputError:
        return
    for name in GEOMETRY_FORMULAS:
        value = getattr(design.geometry, name)
        assert all(map(math.isfinite, value if isinstance(value, tuple) else (value,))), name
    assert design.geometry.contact_ratio >= 1 and isinstance(design.warnings, tuple)
