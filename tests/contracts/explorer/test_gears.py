"""The explorer for given gears, without a browser: state, address, study files, units of maps and figures."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.cli.explore import _view
from gearchaos.errors import InputError
from gearchaos.explorer.core.bounds import value_range
from gearchaos.explorer.core.models import axis_names, check_omega, gear_values, operating_axes
from gearchaos.explorer.core.opened import Opened
from gearchaos.explorer.core.presets import preset_of
from gearchaos.explorer.core.state import view_of
from gearchaos.explorer.core.style import Units
from gearchaos.explorer.core.text import from_query, to_query
from gearchaos.explorer.features.map.job import physical_measures
from gearchaos.explorer.features.map.panel import MapFigure
from gearchaos.explorer.features.motion import point as point_studies
from gearchaos.explorer.features.motion.panel import ForceFigure, times, verdict_text, wheels_of
from gearchaos.explorer.features.motion.point import point_motion
from gearchaos.explorer.web.form import field_values, parameter_form
from gearchaos.explorer.web.page import Page
from gearchaos.gears.operation.operating import OperatingModel, operating_model
from gearchaos.plot import CONTACT_CLASSES
from gearchaos.studies.maps.zones import Zones
from gearchaos.studies.operation.quasi_static import quasi_static_ratio
from gearchaos.studyfile import load_study
from tests import EXAMPLES
from tests.contracts.explorer.test_computations import GEARS, PAIR, PAPER, Put, computed

pytestmark = pytest.mark.slow


@pytest.fixture(params=["design", "pair"])
def first(request):
    return {"design": GEARS, "pair": PAIR}[request.param]


def test_a_page_of_gears_begins_with_contact_over_speed_and_torque_around_the_operating_point(first):
    assert (first.x.name, first.y.name, first.physical) == ("speed", "torque", True)
    speed, torque = (first.model.value(name) for name in ("speed", "torque"))
    assert (first.x.start, first.x.stop) == pytest.approx((0.1 * speed, 2.5 * speed), rel=1e-3)
    assert (first.y.start, first.y.stop) == (0.1 * torque, 2.5 * torque) and first.at[1] == torque
    assert axis_names(first.model)[:2] == ["speed", "torque"] and {"omega", "q0"} < set(axis_names(first.model))
    assert preset_of(first) == "" and first.colour == "contact" and PAPER.colour == "motion"
    assert from_query("speed=3000", first).colour == "contact" == from_query(to_query(first), first).colour
    assert from_query("speed=3000&colour=motion", first).colour == "motion"


@pytest.mark.parametrize("change", [lambda view, speed: view.with_value("speed", speed),
                                    lambda view, speed: view.zoomed((speed, 900.0), (view.y.start, view.y.stop))])
def test_a_speed_too_low_for_a_page_is_refused_in_rpm_with_what_to_do_and_the_least_one_is_accepted(first, change):
    with pytest.raises(InputError) as caught:
        change(first, 5.0)
    error = caught.value
    least = float(re.fullmatch(r"must be at least (\d+) rpm here", error.rule)[1])
    assert (error.field, error.value) == ("speed", 5.0) and "gearchaos regime" in error.advice
    assert f"goes to {quasi_static_ratio(first.model):.3g}." in error.advice
    assert change(first, least)
    with pytest.raises(InputError, match="must be at least"):
        change(first, least - 1)


def test_the_bounds_of_a_map_are_those_of_its_corners_that_bind():
    slow, fast = np.array([0.01, 0.02]), np.array([10.0, 25.0])
    low, high = value_range("omega")[2:]
    for omega, words in ((slow, f"at least {math.ceil(low / 1e-5)} rpm"), (fast, f"at most {high / 0.0125:.0f} rpm")):
        with pytest.raises(InputError, match=words):
            check_omega(PAIR.model, np.array([1000.0, 2000.0]), omega)


def test_the_ranges_of_a_study_file_are_those_of_speed_and_torque():
    loaded = load_study(EXAMPLES / "physical_pair.toml")
    view = _view(loaded, [], False)
    assert (view.x.name, view.y.name) == ("speed", "torque")
    pair = loaded.pair
    assert view.x.start == pytest.approx(0.2 * pair.omega0 / pair.n1 * 30 / np.pi)
    assert view.y.stop == pytest.approx(0.3 * pair.scales.torque1)
    assert _view(loaded, [gc.Axis("omega", 0.5, 1, 9), gc.Axis("eps1", 0, 0.1, 9)], False).x.name == "omega"


def test_the_error_follows_from_the_grade_and_the_scales_from_the_backlash():
    coarse, wide = GEARS.with_value("grade", 8.0), GEARS.with_value("backlash", 240.0)
    assert coarse.point.error.amplitudes[0] == pytest.approx(2 * GEARS.point.error.amplitudes[0], rel=0.1)
    assert wide.point.error.amplitudes[0] == pytest.approx(GEARS.point.error.amplitudes[0] / 2)
    assert wide.gears.to_pair().scales.length == pytest.approx(2 * GEARS.gears.to_pair().scales.length)
    for view in (coarse, wide):
        assert view.map_key != GEARS.map_key and view.line_key != GEARS.line_key
        assert view.point == replace(operating_model(view.gears), initial={})


def test_what_was_set_apart_from_the_gears_stays_unless_the_gears_determine_it_anew():
    set_apart = GEARS.with_value("chi1", 0.2).with_value("eps1", 0.5)
    finer = set_apart.with_value("grade", 4.0)
    assert finer.point.stiffness.chi1 == 0.2
    assert finer.point.error == operating_model(finer.gears).error
    assert GEARS.with_value("zeta", 0.08).gears.damping_ratio == 0.08  # damping is a ratio
    assert PAIR.with_value("zeta", 0.08).point.zeta == pytest.approx(0.08, rel=1e-12)


def test_the_form_has_speed_and_torque_in_place_of_omega_and_q0(first):
    form = parameter_form(first, (), first)
    shown = [field.name for group in form.groups for field in group.fields]
    assert shown == ["speed", "torque", "backlash", *(["grade"] if first is GEARS else []), "zeta"]
    folded = [field.name for group in form.folded for field in group.fields]
    assert "eps1" in folded and not {"omega", "q0", "zeta"} & set(folded)
    units = {f.name: f.unit for g in (*form.groups, *form.folded) for f in g.fields}
    assert (units["speed"], units["torque"], units["backlash"]) == ("rpm", "N m", "µm")
    assert all(units.values()) and units["x1_dot"] == "Δω₀" and units["theta1"] == "rad" and units["eps1"] == "–"
    assert "omega" in field_values(first.with_axis("x", "omega"))
    assert field_values(first).get("grade") == {GEARS: 6.0, PAIR: None}[first]
    page = Page(Opened(first), first)
    page.show_view()
    assert page.messages._values["alike"] == (first is GEARS)  # the wheels of the pair are not
    plain = parameter_form(PAPER, (), PAPER)
    assert not plain.folded and not any(f.unit for g in plain.groups for f in g.fields)


@pytest.mark.parametrize("across", ["speed", "omega"])
def test_a_map_of_gears_has_the_scales_of_each_torque(across):
    view = replace(GEARS.with_axis("x", across), colour="v_rms")
    x, y = (gc.Axis(a.name, a.start, a.stop, n) for a, n in ((view.x, 3), (view.y, 4)))
    study = Zones(view.model, x, y)
    dataset = study.run()
    wanted = gc.physical(dataset.drop_vars(across))["v_rms"]
    found = computed(study, 12)
    assert found.measure("v_rms", physical=True).values == pytest.approx(wanted.values, rel=1e-6)
    assert found.measure("v_rms", physical=True).attrs["units"] == "mm/s"
    ratio = found.measure("v_rms", physical=True).values / found.measure("v_rms").values
    least, most = (view.model.gears.at(torque=end).to_pair().omega0 for end in (y.start, y.stop))
    assert most > 1.3 * least  # by the rule for low loads
    assert ratio[-1] / ratio[0] == pytest.approx(most / least, rel=1e-5)
    known = np.array([[True] * 3, [False] * 3, [True] * 3, [False] * 3])
    part = physical_measures(dataset, view.model.gears, known)["v_rms"].values
    assert part[::2] == pytest.approx(wanted.values[::2], rel=1e-6) and np.isnan(part[1::2]).all()
    assert physical_measures(dataset, None, known) is None


def test_the_diagram_is_in_the_units_of_the_view():
    view = PAIR.moved(20000.0, 180.0)
    small = replace(view, x=replace(view.x, start=19900.0, stop=20100.0))
    scale = view.gears.to_pair().scales.length * 1e6
    views = small, replace(small, physical=False)
    found, plain = ([d for d in point_studies.bifurcation(v, 100) if d][-1] for v in views)
    assert found["section_z"].attrs["units"] == "µm" and "units" in plain["section_z"].attrs
    assert found["section_z"].values == pytest.approx(plain["section_z"].values * scale, nan_ok=True)
    assert small.line_key != replace(small, physical=False).line_key


def test_every_number_of_the_verdict_has_its_unit():
    view = GEARS
    motion = list(point_motion(view.point))[-1]
    for units in (Units(view.gears, True), Units(None, True)):
        text = verdict_text(motion, view, units)
        assert text.where == "n₁ = 3000 rpm, M₁ = 100 N m"
        for name, value in text.rows:
            unit = value.split("\N{NO-BREAK SPACE}")[-1]
            assert name in ("contact", "mesh damping", "quasi-static ratio", "root stress") or unit in (
                "rpm", "Hz", "N m", "N", "mm/s", "µm", "1/s", "[–]", "Δ", "Δω₀", "ω₀"), (name, value)
    rows = dict(verdict_text(motion, view, Units(view.gears, True)).rows)
    assert (rows["mesh damping"], rows["quasi-static ratio"]) == ("in contact alone", "1.75")
    assert rows["root stress"].endswith(" N/mm², whole force")
    assert rows["mesh frequency"] == "2500\N{NO-BREAK SPACE}Hz"
    force = 100 / (0.075 * np.cos(np.radians(20)))
    assert rows["static mesh force"] == f"{force:.5g}\N{NO-BREAK SPACE}N"
    peak = motion.verdict.mesh_force_peak * view.gears.to_pair().scales.force
    assert rows["peak mesh force"] == f"{peak:.5g}\N{NO-BREAK SPACE}N"
    assert float(rows["dynamic factor"].split("\N{NO-BREAK SPACE}")[0]) == pytest.approx(peak / force, rel=1e-4)


def test_the_mesh_force_is_shown_over_time_and_roll_angle():
    figure = ForceFigure(put := Put())
    trajectory = list(point_motion(GEARS.point))[-1].trajectory
    units = Units(GEARS.gears, True)
    figure.show(units.scaled(trajectory), *times(trajectory), units, wheels_of(GEARS))
    data, end = put[figure.source.id]["data"], put[figure.figure.x_range.id]["end"]
    assert put[figure.figure.xaxis[-1].id]["axis_label"] == "time [ms]"
    assert put[figure.figure.yaxis[0].id]["axis_label"] == "mesh force S [N]"
    assert data["x"][-1] == pytest.approx(end, rel=1e-6)
    assert put[figure.figure.extra_x_ranges["roll"].id]["end"] == pytest.approx(end * 1e-3 * 50 * 360, rel=1e-6)
    assert put[figure.static.id]["location"] == pytest.approx(100 / (0.075 * np.cos(np.radians(20))))
    assert data["y"].max() == pytest.approx(trajectory["mesh_force"].values.max() * units.one("mesh_force"), rel=1e-2)
    assert put[figure.figure.id]["visible"]
    figure.clear()  # of a dimensionless model its axes would keep the units of the gears
    assert not put[figure.figure.id]["visible"]


def test_gears_of_a_model_are_those_of_the_point():
    assert GEARS.gears.torque == 100.0 and GEARS.moved(3000.0, 60.0).gears.torque == 60.0
    assert isinstance(GEARS.point, OperatingModel) and PAPER.gears is None
    assert gear_values(GEARS.moved(2500.0, 60.0).point)["speed"] == 2500.0
    assert operating_axes(replace(PAIR.gears, M10=0.0, M20=0.0))[1].start == 0.0


def test_an_axis_of_omega_moves_the_speed():
    view = PAIR.with_axis("x", "omega").moved(1.0, PAIR.at[1])
    pair = PAIR.gears
    assert gear_values(view.point)["speed"] == pytest.approx(pair.omega0 / pair.n1 * 30 / np.pi)
    assert view.with_value("speed", 14000.0).at[0] == pytest.approx(PAIR.point.omega)
    with pytest.raises(InputError, match="axis speed"):
        PAIR.with_value("omega", 1.0)


def test_the_map_of_contact_has_the_classes_of_the_states():
    figure = MapFigure(put := Put())
    study = Zones(GEARS.model, replace(GEARS.x, count=8), replace(GEARS.y, count=6))
    found = computed(study, 24)
    figure.show(found, "contact", Units(None, True))
    image, known = put[figure.image.id]["data"]["image"][0], found.dataset["contact"].values.ravel()[:24]
    np.testing.assert_array_equal(image.ravel()[:24], known)
    assert set(known) > {0} and (image.ravel()[24:] == 255).all()  # the rest is not computed
    assert put[figure.mapper.id]["palette"][:4] == [c.colour for c in CONTACT_CLASSES]
    assert [name for _, name in figure.legend.entries] == [CONTACT_CLASSES[i].name for i in sorted(set(known))]


def test_the_first_map_of_slow_and_of_fast_gears_is_one_that_the_page_accepts():
    resonance = GEARS.model.value("speed") / GEARS.model.omega
    for share in (0.055, 0.2, 3.0, 6.0):
        view = view_of(operating_model(GEARS.gears.at(speed=share * resonance)))
        assert view.x.start < share * resonance < view.x.stop
