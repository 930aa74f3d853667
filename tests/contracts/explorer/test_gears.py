"""The explorer for given gears, without a browser: state, address, study files, units of maps and figures."""

from dataclasses import replace

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.cli.explore import _view
from gearchaos.errors import InputError
from gearchaos.explorer.jobs import point as point_studies
from gearchaos.explorer.jobs.map import MapGrid, physical_measures
from gearchaos.explorer.jobs.point import point_motion
from gearchaos.explorer.panels.motion import ForceFigure, times, verdict_text, wheels_of
from gearchaos.explorer.panels.style import Units
from gearchaos.explorer.view.models import axis_names, gear_values, operating_axes
from gearchaos.explorer.view.presets import preset_of, presets
from gearchaos.explorer.view.state import view_of
from gearchaos.explorer.view.text import as_python, as_toml, from_query, to_query
from gearchaos.explorer.web.page import field_values, parameter_form
from gearchaos.gears.operating import OperatingModel, operating_model
from gearchaos.studies.zones import Zones
from gearchaos.studyfile import load_study
from tests import EXAMPLES

pytestmark = pytest.mark.slow

DESIGN = view_of(load_study(EXAMPLES / "spur_50_50.toml").model)
PAIR = view_of(load_study(EXAMPLES / "physical_pair.toml").model)
FIRST = presets()["2"].view

CHANGES = {
    "none": lambda view: view,
    "point": lambda view: view.moved(2543.2, 77.1),
    "speed": lambda view: view.with_value("speed", 3333.3),
    "torque": lambda view: view.with_value("torque", 61.7),
    "backlash": lambda view: view.with_value("backlash", 87.3),
    "zeta": lambda view: view.with_value("zeta", 0.031),
    "axis omega": lambda view: view.with_axis("x", "omega"),
    "speed, axis omega": lambda view: view.with_axis("x", "omega").with_value("speed", 5000.0),
    "dimensionless axes": lambda view: view.with_axis("x", "omega").with_axis("y", "q0").moved(1.05, 0.21),
    "axis zeta": lambda view: view.with_axis("y", "zeta").moved(3100.0, 0.07),
    "error": lambda view: view.with_value("eps1", 0.3),
    "error, backlash": lambda view: view.with_value("theta1", 0.3).with_value("backlash", 99.0),
    "single": lambda view: view.with_kind("single"),
    "harmonics": lambda view: view.with_stiffness("harmonics").with_value("c1", 0.2),
    "steps": lambda view: view.with_stiffness("steps"),
    "initial": lambda view: view.with_value("x1", 0.4),
    "dimensionless units": lambda view: replace(view, physical=False, colour="v_rms", line="y"),
}


@pytest.fixture(params=["design", "pair"])
def first(request):
    return {"design": DESIGN, "pair": PAIR}[request.param]


def test_the_first_map_is_over_speed_and_torque_in_physical_units(first):
    assert (first.x.name, first.y.name, first.physical) == ("speed", "torque", True)
    speed = first.model.value("speed")
    assert (first.x.start, first.x.stop) == pytest.approx((0.1 * speed, 2.5 * speed), rel=1e-3)
    assert (first.y.start, first.y.stop) == (0.1 * first.at[1], 2.5 * first.at[1])
    assert axis_names(first.model)[:2] == ["speed", "torque"] and {"omega", "q0"} < set(axis_names(first.model))
    assert preset_of(first) == ""


def test_the_ranges_of_a_study_file_are_those_of_speed_and_torque():
    loaded = load_study(EXAMPLES / "physical_pair.toml")
    view = _view(loaded, [], False)
    assert (view.x.name, view.y.name) == ("speed", "torque")
    pair = loaded.pair
    assert view.x.start == pytest.approx(0.2 * pair.omega0 / pair.n1 * 30 / np.pi)
    assert view.y.stop == pytest.approx(0.3 * pair.scales.torque1)
    assert _view(loaded, [gc.Axis("omega", 0.5, 1, 9), gc.Axis("eps1", 0, 0.1, 9)], False).x.name == "omega"


@pytest.mark.parametrize("change", CHANGES)
def test_the_address_restores_the_gears_and_what_was_set_apart_from_them(first, change):
    view = CHANGES[change](first)
    again = from_query(to_query(view), first)
    assert again.point == view.point and to_query(again) == to_query(view)
    assert (again.x, again.y, again.at, again.physical) == (view.x, view.y, view.at, view.physical)
    if "ax" not in change:
        assert again.map_key == view.map_key and again.line_key == view.line_key


@pytest.mark.parametrize("change", CHANGES)
def test_a_copied_study_file_and_script_give_the_point(first, change, tmp_path):
    view, path = CHANGES[change](first), tmp_path / "gears.toml"
    path.write_text(as_toml(view), encoding="utf-8")
    study, names = load_study(path), {}
    found, wanted = study.model.parameters(), view.point.parameters()
    assert {n: found[n] for n in wanted} == pytest.approx(wanted, rel=1e-12)
    assert study.model.initial == view.point.initial and study.model.kind == view.point.kind
    assert study.study(Zones).x.count == view.x.count
    exec(as_python(view).partition("verdict = ")[0], names)
    assert names["model"] == view.point and ("physical" in as_python(view)) == view.physical


def test_a_study_file_of_a_design_is_one_of_the_design(tmp_path):
    view, path = DESIGN.with_value("grade", 9.0).moved(2500.0, 60.0), tmp_path / "design.toml"
    path.write_text(as_toml(view), encoding="utf-8")
    assert "[operation]" in path.read_text(encoding="utf-8")
    study = load_study(path)
    assert study.model == view.point and study.options == {"x": view.x, "y": view.y}
    path.write_text(as_toml(view.with_value("eps1", 0.3)), encoding="utf-8")
    assert "[gearpair]" in path.read_text(encoding="utf-8")


def test_every_address_of_gears_has_their_values_by_name():
    query = to_query(DESIGN.moved(2500.0, 60.0).with_value("grade", 9.0))
    for part in ("speed=2500.0", "torque=60.0", "backlash=120.0", "grade=9.0", "zeta=0.05", "units=physical"):
        assert part in query.split("&")
    assert from_query("speed=450&torque=220", DESIGN).point.value("torque") == 220.0  # far below the resonance
    assert from_query("torque=60", DESIGN).point.value("speed") == pytest.approx(3000.0)


def test_a_dimensionless_address_stays_one_on_a_server_with_gears(first):
    assert from_query(to_query(FIRST), first) == FIRST


@pytest.mark.parametrize(("query", "field"), [
    ("speed=fast", "speed"), ("speed=1e9", "speed"), ("speed=0", "speed"), ("torque=-5", "torque"),
    ("torque=nan", "torque"), ("backlash=0", "backlash"), ("backlash=1e9", "backlash"), ("grade=3.5", "quality.grade"),
    ("grade=13", "grade"), ("speed=3000&zeta=-1", "zeta"), ("speed=3000&wobble=1", "parameter"),
    ("speed=3000&kind=cubic", "kind"), ("speed=3000&stiffness=soft", "stiffness"), ("x=speed=0:100", "speed"),
    ("x=speed=1:100", "omega"), ("speed=3000&x=speed=1000:2000&y=omega=1:2", "axes"),
    ("speed=3000&eps9=0.1", "eps9"), ("speed=3000&q0=1000", "q0"),
])
def test_an_absurd_address_of_gears_is_refused_by_its_field(query, field):
    with pytest.raises(InputError) as caught:
        from_query(query, DESIGN)
    assert caught.value.field.startswith(field)


@pytest.mark.parametrize("query", ["speed=3000", "torque=10", "backlash=100", "grade=5", "x=speed=1000:2000"])
def test_values_of_gears_are_refused_in_words_without_gears(query):
    with pytest.raises(InputError, match="needs gears"):
        from_query(query, FIRST)


def test_a_pair_has_no_grade():
    with pytest.raises(InputError, match="grade must be a value of the gears loaded"):
        from_query("grade=5", PAIR)
    assert "grade" not in field_values(PAIR) and field_values(DESIGN)["grade"] == 6.0


def test_the_error_follows_from_the_grade_and_the_scales_from_the_backlash():
    coarse, wide = DESIGN.with_value("grade", 8.0), DESIGN.with_value("backlash", 240.0)
    assert coarse.point.error.amplitudes[0] == pytest.approx(2 * DESIGN.point.error.amplitudes[0], rel=0.1)
    assert wide.point.error.amplitudes[0] == pytest.approx(DESIGN.point.error.amplitudes[0] / 2)
    assert wide.gears.to_pair().scales.length == pytest.approx(2 * DESIGN.gears.to_pair().scales.length)
    for view in (coarse, wide):
        assert view.map_key != DESIGN.map_key and view.line_key != DESIGN.line_key
        assert view.point == replace(operating_model(view.gears), initial={})


def test_what_was_set_apart_from_the_gears_stays_unless_the_gears_determine_it_anew():
    set_apart = DESIGN.with_value("chi1", 0.2).with_value("eps1", 0.5)
    finer = set_apart.with_value("grade", 4.0)
    assert finer.point.stiffness.chi1 == 0.2
    assert finer.point.error == operating_model(finer.gears).error


def test_damping_of_gears_is_a_ratio():
    assert DESIGN.with_value("zeta", 0.08).gears.damping_ratio == 0.08
    assert PAIR.with_value("zeta", 0.08).point.zeta == pytest.approx(0.08, rel=1e-12)


def test_the_form_has_speed_and_torque_in_place_of_omega_and_q0(first):
    form = parameter_form(first, (), first)
    shown = [field.name for group in form.groups for field in group.fields]
    assert shown == ["speed", "torque", "backlash", *(["grade"] if first is DESIGN else []), "zeta"]
    folded = [field.name for group in form.folded for field in group.fields]
    assert "eps1" in folded and not {"omega", "q0", "zeta"} & set(folded)
    units = {f.name: f.unit for g in (*form.groups, *form.folded) for f in g.fields}
    assert (units["speed"], units["torque"], units["backlash"]) == ("rpm", "N m", "µm")
    assert all(units.values()) and units["x1_dot"] == "Δω₀" and units["theta1"] == "rad" and units["eps1"] == "–"
    omega = first.with_axis("x", "omega")
    assert "omega" in field_values(omega)
    plain = parameter_form(FIRST, (), FIRST)
    assert not plain.folded and not any(f.unit for g in plain.groups for f in g.fields)


@pytest.mark.parametrize("across", ["speed", "omega"])
def test_a_map_of_gears_has_the_scales_of_each_torque(across):
    view = replace(DESIGN.with_axis("x", across), colour="v_rms")
    x, y = (gc.Axis(a.name, a.start, a.stop, n) for a, n in ((view.x, 3), (view.y, 4)))
    study = Zones(view.model, x, y)
    dataset = study.run()
    wanted = gc.physical(dataset.drop_vars(across))["v_rms"]
    grid = MapGrid(3, 4)
    grid.put(study.compute(np.arange(12)), np.arange(12))
    grid.show(np.arange(12), 1)
    found = grid.map(study, 1)
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
    view = DESIGN
    motion = list(point_motion(view.point))[-1]
    for units in (Units(view.gears, True), Units(None, True)):
        text = verdict_text(motion, view, units)
        assert text.where == "n₁ = 3000 rpm, M₁ = 100 N m"
        for name, value in text.rows:
            unit = value.split("\N{NO-BREAK SPACE}")[-1]
            assert name in ("contact", "mesh damping", "quasi-static ratio") or unit in (
                "rpm", "Hz", "N m", "N", "mm/s", "µm", "1/s", "[–]", "Δ", "Δω₀", "ω₀"), (name, value)
    rows = dict(verdict_text(motion, view, Units(view.gears, True)).rows)
    assert (rows["mesh damping"], rows["quasi-static ratio"]) == ("in contact alone", "1.75")
    assert rows["mesh frequency"] == "2500\N{NO-BREAK SPACE}Hz"
    force = 100 / (0.075 * np.cos(np.radians(20)))
    assert rows["static mesh force"] == f"{force:.5g}\N{NO-BREAK SPACE}N"
    peak = motion.verdict.mesh_force_peak * view.gears.to_pair().scales.force
    assert rows["peak mesh force"] == f"{peak:.5g}\N{NO-BREAK SPACE}N"
    assert float(rows["dynamic factor"].split("\N{NO-BREAK SPACE}")[0]) == pytest.approx(peak / force, rel=1e-4)


def test_the_mesh_force_is_shown_over_time_and_roll_angle():
    put = {}
    figure = ForceFigure(lambda model, **attributes: put.setdefault(model.id, {}).update(attributes))
    trajectory = list(point_motion(DESIGN.point))[-1].trajectory
    units = Units(DESIGN.gears, True)
    figure.show(units.scaled(trajectory), *times(trajectory), units, wheels_of(DESIGN))
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
    assert DESIGN.gears.torque == 100.0 and DESIGN.moved(3000.0, 60.0).gears.torque == 60.0
    assert isinstance(DESIGN.point, OperatingModel) and FIRST.gears is None
    assert gear_values(DESIGN.moved(2500.0, 60.0).point)["speed"] == 2500.0
    assert operating_axes(replace(PAIR.gears, M10=0.0, M20=0.0))[1].start == 0.0


def test_an_axis_of_omega_moves_the_speed():
    view = PAIR.with_axis("x", "omega").moved(1.0, PAIR.at[1])
    pair = PAIR.gears
    assert gear_values(view.point)["speed"] == pytest.approx(pair.omega0 / pair.n1 * 30 / np.pi)
    assert view.with_value("speed", 14000.0).at[0] == pytest.approx(PAIR.point.omega)
    with pytest.raises(InputError, match="axis speed"):
        PAIR.with_value("omega", 1.0)


@pytest.mark.parametrize("view", [DESIGN, PAIR])
def test_a_page_of_gears_begins_with_contact_around_the_operating_point(view):
    speed, torque = (view.model.value(name) for name in ("speed", "torque"))
    assert view.colour == "contact" and FIRST.colour == "motion"
    assert (view.x.start, view.x.stop) == pytest.approx((0.1 * speed, 2.5 * speed), rel=1e-2)
    assert (view.y.start, view.y.stop) == pytest.approx((0.1 * torque, 2.5 * torque), rel=1e-2)
    assert from_query("speed=3000", view).colour == "contact" == from_query(to_query(view), view).colour
    assert from_query("speed=3000&colour=motion", view).colour == "motion"


def test_the_map_of_contact_has_the_classes_of_the_states():
    from gearchaos.explorer.panels.map import MapFigure
    from gearchaos.plot import CONTACT_CLASSES

    sent = []
    figure = MapFigure(lambda model, **values: sent.append((model, values)))
    study = Zones(DESIGN.model, replace(DESIGN.x, count=8), replace(DESIGN.y, count=6))
    grid, cells = MapGrid(8, 6), np.arange(24)
    grid.put(study.compute(cells), cells)
    grid.show(cells, 1)
    figure.show(grid.map(study, 1), "contact", Units(None, True))
    image = next(v["data"]["image"][0] for m, v in sent if m is figure.image)
    known = grid.found["contact"][:24]
    np.testing.assert_array_equal(image.ravel()[:24], known)
    assert set(known) > {0} and (image.ravel()[24:] == 255).all()  # the rest is not computed
    palette = next(v["palette"] for m, v in sent if m is figure.mapper)
    assert palette[:4] == [c.colour for c in CONTACT_CLASSES]
    assert [name for _, name in figure.legend.entries] == [CONTACT_CLASSES[i].name for i in sorted(set(known))]


def test_the_first_map_of_slow_and_of_fast_gears_is_one_that_the_page_accepts():
    resonance = DESIGN.model.value("speed") / DESIGN.model.omega
    for share in (0.055, 0.2, 3.0, 6.0):
        view = view_of(operating_model(DESIGN.gears.at(speed=share * resonance)))
        assert view.x.start < share * resonance < view.x.stop
