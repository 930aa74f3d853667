"""Views as text: the address bar, the study file and the script that a visitor takes along, and what is refused."""

from dataclasses import replace

import pytest

import gearchaos as gc
from gearchaos.cli.explore import _view
from gearchaos.errors import InputError
from gearchaos.explorer.core.presets import presets
from gearchaos.explorer.core.state import view_of
from gearchaos.explorer.core.text import as_python, as_toml, from_query, pair_at, to_query
from gearchaos.studyfile import load_study
from tests import EXAMPLES
from tests.contracts.explorer.test_computations import GEARS, PAIR, PAPER

LOADED = load_study(EXAMPLES / "physical_pair.toml")
PLAIN = view_of(LOADED.model, *(LOADED.options_for("zones")[axis] for axis in "xy"))  # over ω and the error
TRAIN = _view(load_study(EXAMPLES / "train_idler.toml"), [], False)
STARTS = (("z", 0.3), ("z_dot", -0.1))
EVERYTHING = gc.MeshModel(
    kind="full", zeta=0.03, J1=1.5, J2=2.5, q1=0.1, q2=0.12, beta1=0.02, beta2=0.0, mu1=3.0, kappa2=1 / 3,
    zeta_support1=0.02, error=gc.TransmissionError((0.1, 0.02), (0.3, -0.1)),
    stiffness=gc.HarmonicStiffness((0.2, 0.05), (0.1,)), initial={"x1": 0.5, "y2_dot": -0.25})


def each_part(view):
    """With each value of a pair set apart from it."""
    for name, value in {"eps2": 0.0, "theta1": 1.0, "kappa1": 2.0, "mu2": 3.0, "beta": 0.01, "chi1": 0.3, "y1": 0.4,
                        "zeta": 0.06}.items():
        view = view.with_value(name, value)
    return view


OF_GEARS = {
    "none": lambda view: view, "point": lambda view: view.moved(2543.2, 77.1),
    "backlash": lambda view: view.with_value("backlash", 87.3), "axis omega": lambda view: view.with_axis("x", "omega"),
    "speed, axis omega": lambda view: view.with_axis("x", "omega").with_value("speed", 5000.0),
    "dimensionless axes": lambda view: view.with_axis("x", "omega").with_axis("y", "q0").moved(1.05, 0.21),
    "axis zeta": lambda view: view.with_axis("y", "zeta").moved(3100.0, 0.07),
    "error": lambda view: view.with_value("eps1", 0.3),
    "error, backlash": lambda view: view.with_value("theta1", 0.3).with_value("backlash", 99.0),
    "single": lambda view: view.with_kind("single"),
    "harmonics": lambda view: view.with_stiffness("harmonics").with_value("c1", 0.2),
    "steps": lambda view: view.with_stiffness("steps"),
    "dimensionless units": lambda view: replace(view, physical=False, colour="v_rms", line="y"),
    "initial": lambda view: view.with_value("x1", 0.4)}
VIEWS = {
    **{f"preset {key}": (PAPER, presets()[key].view.with_value("zeta", 1 / 30)) for key in presets()},
    "everything": (PAPER, replace(
        view_of(EVERYTHING), y=gc.Axis("c2", 0.0, 0.1, 300), at=(1.1, 0.07), colour="v_rms", line="y",
        initial=(("x1", 2.0), ("x1_dot", 1e-17)), physical=True)),
    "start": (PAPER, replace(presets()["3c"].view, initial=STARTS)),
    "start, harmonics": (PAPER, replace(presets()["3c"].view.with_stiffness("harmonics"), initial=STARTS)),
    **{f"{name}, {change}": (first, OF_GEARS[change](first))
       for name, first in (("design", GEARS), ("pair", PAIR)) for change in OF_GEARS},
    "design, grade": (GEARS, GEARS.with_value("grade", 9.0).moved(2500.0, 60.0)),
    "design, run": (GEARS, GEARS.with_run(start=512.3, duration=1 / 3, way="down", sound=True)),
    "pair, each part": (PAIR, each_part(PAIR)), "pair, over ω and ε₁": (PLAIN, each_part(PLAIN.moved(1.05, 0.21))),
    "of the paper, with gears": (GEARS, PAPER), "train": (TRAIN, TRAIN),
    "train, load": (TRAIN, TRAIN.moved(4000.0, 12.0).with_axis("y", "idler_pump.backlash")),
    "train, part": (TRAIN, TRAIN.with_value("idler.inertia", 5e-4)),
    "train, mesh": (TRAIN, replace(TRAIN, mesh="idler/pump", colour="dynamic_factor", line="y"))}
"""Views by name, each with the first view of its server."""


@pytest.mark.parametrize("name", VIEWS)
def test_address_study_file_and_script_give_the_view(name, tmp_path):
    (first, view), path, names = VIEWS[name], tmp_path / "study.toml", {}
    again = from_query("?" + to_query(view, first), first)
    assert again.point == view.point and to_query(again, first) == to_query(view, first)
    assert replace(again, model=view.model) == view
    if "ax" not in name and "over" not in name:  # else a value that an axis varies may be any
        assert again.map_key == view.map_key and again.line_key == view.line_key
    path.write_text(as_toml(view), encoding="utf-8")
    study, wanted = load_study(path), view.point.parameters()
    assert {n: study.model.parameters()[n] for n in wanted} == pytest.approx(wanted, rel=1e-12)
    assert (study.model.kind, study.model.initial) == (view.point.kind, view.point.initial)
    assert tuple(study.options_for("zones")[axis] for axis in "xy") == (view.x, view.y)
    if view.model.kind != "train":
        assert (study.pair and study.pair.scales) == (view.gears and view.gears.to_pair().scales)
    script = as_python(view)
    compile(script, "copied", "exec")
    exec(script.partition("verdict = ")[0], names)
    assert names["model"].parameters() == wanted and (names["model"] == view.point or view.model.kind == "train")
    assert ("physical" in script) == (view.physical and view.gears is not None)


def test_an_empty_address_shows_what_the_server_was_started_with():
    assert from_query("", PAPER) is PAPER


def test_the_address_has_the_run_once_it_is_set():
    assert "run=" not in to_query(GEARS, GEARS) and presets()["2"].view.run is None
    for values in ({"start": 512.3}, {"sound": True}, {"duration": 1 / 3}):
        assert "run=" in to_query(GEARS.with_run(**values), GEARS)
    assert from_query("q0=0.1", GEARS).run is None


def test_a_study_file_of_a_design_is_one_of_the_design_while_its_gears_are_those_of_it(tmp_path):
    view, path = GEARS.with_value("grade", 9.0).moved(2500.0, 60.0), tmp_path / "design.toml"
    path.write_text(as_toml(view), encoding="utf-8")
    assert "[operation]" in as_toml(view) and load_study(path).model == view.point
    assert "[gearpair]" in as_toml(view.with_value("eps1", 0.3))
    python = {}
    exec(as_python(PAIR).partition("verdict = ")[0], python)
    assert python["gears"] == LOADED.pair


def test_other_kinds_of_a_pair_keep_it_and_what_no_pair_has_is_a_model(tmp_path):
    path = tmp_path / "pair.toml"
    for changed, kept in (
        (PAIR.with_kind("torsional"), True), (PAIR.with_kind("single"), True), (PAIR.with_value("J1", 3.0), False)):
        path.write_text(as_toml(changed), encoding="utf-8")
        study = load_study(path)
        assert (study.pair is not None) == kept and study.model.kind == changed.model.kind
        assert gc.regime(study.model).v_rms == pytest.approx(gc.regime(changed.point).v_rms, rel=1e-6)
    rigid = replace(LOADED.pair, **dict.fromkeys(("c1", "c2", "m1", "m2")), k1=0.0, k2=0.0)
    assert pair_at(rigid, PAIR.point) is None


def test_every_address_of_gears_has_their_values_by_name():
    query = to_query(GEARS.moved(2500.0, 60.0).with_value("grade", 9.0))
    for part in ("speed=2500.0", "torque=60.0", "backlash=120.0", "grade=9.0", "zeta=0.05", "units=physical"):
        assert part in query.split("&")
    assert from_query("speed=450&torque=220", GEARS).point.value("torque") == 220.0  # far below the resonance
    assert from_query("torque=60", GEARS).point.value("speed") == pytest.approx(3000.0)


REFUSED = [
    (PAPER, "kind=cubic", "kind"), (PAPER, "omega=fast", "omega"), (PAPER, "omega=nan", "omega"),
    (PAPER, "omega=1e9", "omega"), (PAPER, "q0=1e300", "q0"), (PAPER, "J1=0", "J1"), (PAPER, "chi1=-1", "chi1"),
    (PAPER, "contact_ratio=7", "contact_ratio"), (PAPER, "eps9=0.1", "eps9"), (PAPER, "eps99=0.1", "eps99"),
    (PAPER, "wobble=1", "parameter"), (PAPER, "colour=red", "colour"), (PAPER, "line=z", "line"),
    (PAPER, "x=omega", "x"), (PAPER, "x=omega=3:1", "axis omega"), (PAPER, "x=omega=0:1", "omega"),
    (PAPER, "x=eps1=0:1&y=eps1=0:1", "axes"), (PAPER, "x=kappa=1:2", "kappa1"), (PAPER, "at=1", "at"),
    (PAPER, "at=1,x", "at"), (PAPER, "at=inf,0", "omega"), (PAPER, "start=w=1", "start"), (PAPER, "start=x1=1e9", "x1"),
    (PAPER, "units=furlongs", "units"), (PAPER, "x1=1e99", "x1"), (PAPER, "kind=single&beta=0.1", "beta"),
    (PAPER, "stiffness=wobbly", "stiffness"), (PAPER, "stiffness=harmonics&c1=0.9&c2=0.9", "stiff"),
    (PAPER, "omega=" + "1" * 5000, "address"),
    (GEARS, "speed=fast", "speed"), (GEARS, "speed=1e9", "speed"), (GEARS, "speed=0", "speed"),
    (GEARS, "torque=-5", "torque"), (GEARS, "torque=nan", "torque"), (GEARS, "backlash=0", "backlash"),
    (GEARS, "backlash=1e9", "backlash"), (GEARS, "grade=3.5", "quality.grade"), (GEARS, "grade=13", "grade"),
    (GEARS, "speed=3000&zeta=-1", "zeta"), (GEARS, "speed=3000&wobble=1", "parameter"),
    (GEARS, "speed=3000&stiffness=soft", "stiffness"), (GEARS, "x=speed=0:100", "speed"),
    (GEARS, "x=speed=1:100", "speed must be at least"), (GEARS, "speed=3000&x=speed=1000:2000&y=omega=1:2", "axes"),
    (GEARS, "speed=3000&eps9=0.1", "eps9"), (GEARS, "speed=3000&q0=1000", "q0"),
    *((PAPER, f"{value}", "needs gears") for value in ("speed=3000", "torque=10", "backlash=100", "grade=5",
                                                        "x=speed=1000:2000")),
    (PAIR, "grade=5", "grade must be a value of the gears loaded"), (GEARS, "q0=0.1&run=500:6000,10,up", "needs gears"),
    *((GEARS, f"run={text}&speed=3000", words) for text, words in (
        ("500:6000", "must read"), ("500,10,up", "must read"), ("500:6000,10,up,loud", "must read"),
        ("500:6000,10,left", "got 'left'"), ("6000:500,10,up", "to a higher speed"), ("0:500,10,up", "must lie in"),
        ("500:6000,0,up", "must lie in"), ("500:6000,nan,up", "a finite number"), ("x:6000,10,up", "must be a number"),
        ("500:6000,30.1,up", "must lie in (0, 30]"), ("500:6000,15.1,down", "must lie in (0, 15]"),
        ("500:1e99,10,up", "must lie in"))),
    (TRAIN, "kind=full", "kind"), (TRAIN, "omega=1", "parameter"), (TRAIN, "mesh=third", "mesh"),
    (TRAIN, "speed=0", "speed"), (TRAIN, "motor.torque=30", "body pump: torque"),
    (TRAIN, "idler.inertia=-1", "body idler: inertia"), (TRAIN, "x=motor.torque=1:2&y=speed=1000:2000", "motor.torque")]


@pytest.mark.parametrize(("first", "query", "words"), REFUSED, ids=[query[:40] for _, query, _ in REFUSED])
def test_an_absurd_address_is_refused_by_its_field_or_in_words(first, query, words):
    with pytest.raises(InputError) as caught:
        from_query(query, first)
    assert str(caught.value).startswith(words) or (" " in words and words in str(caught.value))
