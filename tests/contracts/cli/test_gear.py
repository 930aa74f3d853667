"""The command `gear`: the answer first, in lines of 80 columns, for one torque or several, and what cannot be given."""

import json
import math
import re
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from gearchaos.cli.avoided import criteria, print_avoided
from gearchaos.cli.datasheets import print_datasheets
from gearchaos.cli.output import plain_table, print_table
from gearchaos.datasheet.answer import DesignAnswer, default_speeds
from gearchaos.datasheet.assessment import at_no_speed, avoided, edges
from gearchaos.datasheet.page import sheet_html
from gearchaos.errors import InputError
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.dynamic_factor import standards
from gearchaos.gears.io.units import RPM, measured
from gearchaos.studies.speeds.criteria import Criteria
from gearchaos.studies.speeds.speed_windows import Reached, Window
from gearchaos.studies.speeds.speeds_to_avoid import speeds_to_avoid
from gearchaos.studyfile import load_design
from tests import EXAMPLES, ONE_SPRING
from tests.commands import ask

SPUR = ONE_SPRING
SCAN = ("--speed", "1500:2000:2")
WIDTH = 80
SHIFTED = GearDesign(
    teeth=(23, 81), module="2.5 mm", face_width="22 mm", centre_distance="131.5 mm", profile_shift=(0.35, 0.2751),
    bore=("20 mm", "40 mm"), quality={"standard": "ISO 1328-1:1995", "grade": 7}, damping_ratio=0.05,
    transmission_error="from quality", backlash={"value": "0.15 mm", "of": "line of action, total"},
    damping_law="always", load_sharing="prescribed")


@pytest.fixture(autouse=True)
def searched_once(monkeypatch):
    """A search that an earlier command made is not made again: most commands here print the same few in other ways."""
    monkeypatch.setattr("gearchaos.studies.speeds.speeds_to_avoid.speeds_to_avoid", search)


FOUND, STARTS = {}, 32
"""Searches that were made, and the random initial states of each, of which 512 would be followed without that."""


def search(design, speed, **options):
    asked = repr((design, speed, options))
    if asked not in FOUND:
        FOUND[asked] = speeds_to_avoid(design, speed, **options, starts=STARTS)
    return FOUND[asked]


def gear(*arguments, code=0):
    return ask("gear", *arguments, code=code)


def written(tmp_path, rows, key):
    """The 50/50 pair with a table for one of its curves."""
    (tmp_path / "curve.csv").write_text(rows)
    lines = [line for line in SPUR.read_text().splitlines() if not line.startswith(key)]
    lines.insert(lines.index("[design]") + 1, f'{key} = {{ table = "curve.csv" }}')
    path = tmp_path / "design.toml"
    path.write_text("\n".join(lines))
    return path


def warnings_of(result):
    return [line for line in result.stderr.splitlines() if re.match("warning: |  \\S|and ", line)]


@pytest.mark.slow
def test_the_answer_comes_first_in_lines_of_80_columns():
    result = gear(SPUR, *SCAN, "--torque", 60)
    lines = [*result.stdout.splitlines(), *warnings_of(result)]
    assert len(lines) <= 26 and max(map(len, lines)) <= WIDTH
    assert lines[0].startswith("at 60 N m avoid ≤ 1500 to ≥ 2000 rpm: at worst ")
    assert "where there may be a reversal of the load, avoid the same speeds" in lines[:4]
    for text in ("Spur gear pair 50/50, module 3 mm, b 20 mm, a 150 mm, grade 6", "60 N m at wheel 1, F_t/b 40 N/mm",
                 "main resonance  4080 rpm", "Tried: from rest", "make a factor of 1.75",
                 "warning: The accuracy grade"):
        assert any(text in line for line in lines), text
    assert "gear_ratio" not in result.stdout


@pytest.mark.slow
def test_a_range_has_rounded_edges_its_factor_and_what_leads_there():
    bent, scan = EXAMPLES / "spur_50_50.toml", ("--speed", "2000:3000:2", "--torque", 300)
    found = json.loads(gear(bent, *scan, "--json").stdout)["speeds_to_avoid"]
    (window,) = [window for window in found["ranges"] if window["operation"]]
    (row,) = [line.split() for line in gear(bent, *scan, "--all").stdout.splitlines() if "hits by history" in line]
    assert window["stop"] <= float(row[1]) < window["stop"] + window["stop_resolution"] + 10
    assert row[-5:-2] == [measured(window["dynamic_factor"], 3), f"{window['speed_of_largest']:.0f}",
                          measured(max(window["root_stress"]), 3)]
    assert window["reached_by"] == ["rest", "rising speed", "falling speed", "load change"]
    assert 0 < window["share_of_load_changes"] <= 1
    operation = (each["dynamic_factor"] for each in window["reached"] if each["motion"] != "load change")
    assert window["dynamic_factor"] == max(filter(None, operation))


def window(start, stop, start_resolution, stop_resolution, **ends):
    return Window(start, stop, 2.0, start, start_resolution, stop_resolution, (), True, "", "", False, False,
                  **{"from_scan_start": False, "to_scan_end": False, **ends}, begins_with="", ends_with="",
                  history=None, random_states=None, meshes=(), peaks=())


@pytest.mark.parametrize(("found", "shown"), [
    (window(2322.5114037, 2555.3, 11.6, 12.8), ("2310", "2569")), (window(533.0, 533.0, 103.0, 103.0), ("430", "636")),
    (window(533.2, 540.1, 0.4, 2.0), ("532", "543")), (window(1014.2, 10120.0, 0.5, 0.5), ("1013", "10121")),
    (window(500.0, 8000.0, 0.0, 0.0, from_scan_start=True, to_scan_end=True), ("≤ 500", "≥ 8000"))])
def test_edges_are_rounded_outwards_to_whole_speeds(found, shown):
    assert edges(found) == shown


def test_what_only_the_history_decides_and_what_is_elsewhere_is_said():
    """At 180 N m 23/81 stays in contact from rest where it separates when the speed falls, see the manual."""
    found = speeds_to_avoid(SHIFTED, "5000:8000:16", 180)
    window = next(each for each in found.windows if each.operation and each.history)
    inside = found.dataset.sel(speed=slice(*window.history))
    assert (inside["contact"].sel(motion="rest") == 0).any() and (inside["contact"].max("motion") > 0).all()
    outside, separate = found.elsewhere
    assert outside.stop < found.windows[0].start and not separate
    largest = float(found.dataset["dynamic_factor"].sel(speed=slice(None, outside.stop)).max())
    assert outside.dynamic_factor == largest
    text = " ".join(DesignAnswer.of(SHIFTED.at(speed=6000, torque=180), found).basis)
    assert f"Elsewhere: in contact in all motions found, largest factor {measured(largest, 3)} at" in text


def test_elsewhere_has_no_factor_where_all_motions_are_beyond_the_teeth():
    found = speeds_to_avoid(SHIFTED, "5000:5050:2", 180, starts=0, knocks=False)
    ds = found.dataset.assign(dynamic_factor=found.dataset["dynamic_factor"] * np.nan)
    text = " ".join(DesignAnswer.of(SHIFTED.at(speed=5000, torque=180), replace(found, dataset=ds)).basis)
    assert "Elsewhere: in contact in all motions found, all of them beyond the teeth." in text


@pytest.mark.parametrize(("text", "stress"), [
    ("300", "300 N/mm^2"), ("1e3", "1e3 N/mm^2"), ("0.3 GPa", "0.3 GPa"), ("inf", "inf")])
def test_a_root_stress_is_a_number_in_any_notation_or_has_a_unit(text, stress):
    assert criteria(None, text, "1", False)["root_stress"] == stress


def test_a_change_of_the_load_beside_wide_ranges_is_refused_since_it_has_no_effect():
    for change in ("0.5", "none"):
        with pytest.raises(InputError, match="--load-change must be left out with --wide"):
            criteria(None, None, change, True)
    assert criteria(None, None, "1", True)["wide"]


def test_without_separation_among_the_criteria_contact_elsewhere_is_not_claimed():
    found = speeds_to_avoid(SHIFTED, "7000:7100:2", 180, factor=5, separation=False)
    text = " ".join(DesignAnswer.of(SHIFTED.at(speed=7000, torque=180), found).basis)
    assert not found.windows and "Elsewhere: the teeth separate at some speeds, largest factor 4." in text


def test_in_tables_a_long_word_is_folded_not_cut_and_a_unit_in_brackets_is_no_markup(capsys):
    table = plain_table(*(f"c{i}" for i in range(8)), left=["c0"])
    table.title = "angle [deg]"
    table.add_row("[um]", *["neimark-sacker"] * 7)
    print_table(table)
    shown = capsys.readouterr().out
    assert "…" not in shown and shown.count("k") == 7 * 2 and max(map(len, shown.splitlines())) <= 80
    assert "angle [deg]" in shown and "[um]" in shown


def test_numbers_have_no_more_digits_than_are_known():
    assert [measured(v) for v in (2322.5114037, 84.3303, 0.012345678, 14000.0, 123456.7, 0.0)] == [
        "2323", "84.33", "0.01235", "14000", "123500", "0"]
    assert measured(float("nan")) == "none" and measured(22432.1, 3) == "22400"


@pytest.mark.slow
def test_every_torque_has_an_answer():
    for options in (("--torque", "60,180"), ("--torque", "60", "--torque", "180"), ("--torque", "0.06,0.18 kN*m")):
        result = gear(SPUR, *SCAN, *options)
        assert re.findall(r"load +(\S+) N m", result.stdout) == ["60", "180"]
        assert len(warnings_of(result)) == 2, "the warning of both is printed once"
    documents = json.loads(gear(SPUR, "--torque", "60,180", "--json").stdout)["torques"]
    loads = [each["quantities"]["line_load"]["value"] for each in documents]
    assert loads == pytest.approx([40, 120]) and all(each["model"] for each in documents)
    refused = gear(SPUR, "--torque", "56,5 N*m", code=2)
    assert "--torque must rise from one to the next; got '56,5 N*m'" in refused.stderr
    alone = json.loads(gear(SPUR, "--torque", "180", "--json").stdout)
    assert alone == documents[1]


def test_without_speeds_those_around_the_main_resonance_are_looked_through():
    design = load_design(SPUR)
    start, stop, count = map(float, default_speeds(design).split(":"))
    resonance = 4350.12
    assert start == pytest.approx(0.1 * resonance, rel=0.05) and stop == pytest.approx(1.5 * resonance, rel=0.01)
    assert count == 60
    slow, fast = replace(design, speed=100), replace(design, speed=7000)
    assert default_speeds(slow).startswith("100:") and default_speeds(fast).split(":")[1] == "7700"
    few = replace(design, teeth=(20, 20), centre_distance=None, module=0.01, face_width=0.2, bore=0.0)
    velocity = float(default_speeds(few).split(":")[1]) * RPM * 0.1
    assert velocity == pytest.approx(60, rel=0.01), "a range that ends at 60 m/s"
    document = json.loads(gear(SPUR, "--json").stdout)
    assert document["speeds_to_avoid"] is None and document["model"]


@pytest.mark.slow
def test_all_shows_every_quantity_above_its_formula_in_80_columns():
    result = gear(SPUR, *SCAN, "--torque", "60,180", "--all")
    first, second = result.stdout.split("What differs at 180 N m")
    names = re.findall(r"^  (\w+)  ", first.rpartition("Tried: ")[2], re.MULTILINE)
    assert set(json.loads(gear(SPUR, "--json").stdout)["quantities"]) == set(names)
    assert "line_load" in second and "gear_ratio" not in second and "Kv_ISO_C" not in second
    for part, standard in product((first, second), standards()):
        assert len(re.findall(rf"  {standard.heading}(?=  |$)", part, re.MULTILINE)) == 1
    assert max(len(line.rstrip()) for line in result.stdout.splitlines()) <= WIDTH


LEVELS = ("stiffness", "fraction,stiffness [N/um]\n0,300\n1,x\n", "resonance_speed",
          ("lower_limit_ratio", "reduced_mass"))
ERRORS = ("transmission_error", "roll angle [deg],error [um]\n0,1\n7.2,x\n", "transmission_error_amplitudes",
          ("resonance_speed", "Kv_ISO_B"))


@pytest.mark.slow
@pytest.mark.parametrize(("table", "options"), [
    (LEVELS, ()), (LEVELS, SCAN), (LEVELS, ("--all",)), (LEVELS, ("--json",)), (ERRORS, ("--json",))])
def test_a_table_that_cannot_be_read_is_one_message_and_exit_code_2(tmp_path, table, options):
    key, rows, lost, kept = table
    path, page = written(tmp_path, rows, key), tmp_path / "page.html"
    result = gear(path, *options, *(() if options else ("--out", page)), code=2)
    assert [line for line in result.stderr.splitlines() if "finite numbers" in line] == [
        f"error: {tmp_path / 'curve.csv'}, line 3, must have finite numbers; got 'x'. Write e.g. 1234.5: no unit, "
        "nothing between thousands."]
    if "--json" in options:
        quantities = json.loads(result.stdout)["quantities"]
        assert quantities[lost]["value"] is None and all(quantities[name]["value"] for name in kept)
    else:
        assert result.stdout.count("finite") == ("--all" in options)
        assert "speeds to avoid not computed: see the error" in result.stdout
    if not options:  # in the answer, and where what has no value is named
        assert page.read_text().count("finite numbers") == 2


def test_inputs_that_were_left_out_are_named_and_are_an_error_only_where_speeds_are_asked_for(tmp_path):
    path = tmp_path / "few.toml"
    body = SPUR.read_text().partition("[operation]")[0]
    path.write_text("\n".join(line for line in body.splitlines() if not line.startswith("damping")))
    result = gear(path)
    assert "speeds to avoid not computed: damping_ratio and torque must be given" in result.stdout
    assert "no torque is given" in result.stdout and "error" not in result.stderr.replace("transmission error", "")
    for options in (SCAN, ("--factor", 2), ("--plot", tmp_path / "x.png")):
        found = gear(path, *options, code=2).stderr
        assert found.startswith("error: ") and len(found.splitlines()) == 1
    assert not (tmp_path / "x.png").exists()


@pytest.mark.slow
def test_more_warnings_than_fit_are_counted():
    options = (*SCAN, "--set", "design.damping_ratio=0.9", "--set", "design.mass=900", "--torque", 30000)
    result = gear(SPUR, *options)
    lines = [*result.stdout.splitlines(), *warnings_of(result)]
    assert re.match(r"and \d more warnings?: --all shows them", lines[-1])
    assert result.stderr.count("warning: ") == 3
    every = gear(SPUR, *options, "--all")
    assert every.stderr.count("warning: ") == 3 + int(lines[-1].split()[1])


def test_narrow_ranges_are_gathered_in_a_line_unless_all_are_asked_for(capsys):
    design = load_design(SPUR)
    ranges = tuple(replace(window(100.0 * n, 100.0 * n + width, 0.0, 0.0), criterion="the teeth separate",
                           contact="loss of contact", reached=(Reached("from rest", 1.0, 2.0),))
                   for n, width in enumerate((50.0, 1.0, 2.0, 50.0, 1.0, 1.0, 1.0), 10))
    found = replace(speeds_to_avoid(design, "1000:1100:2", starts=0, knocks=False), windows=ranges)
    print_avoided(avoided(found, design, every=False))
    printed = capsys.readouterr().out
    assert [line.split()[:2] for line in printed.splitlines()[2:4]] == [["1000", "1050"], ["1300", "1350"]]
    assert ("and 5 ranges narrower than 1 %: 1100 to 1101, 1200 to 1202, 1400 to 1401, 1500 to 1501, "
            "… rpm") in " ".join(printed.split())
    print_avoided(avoided(found, design, every=True))
    assert len(capsys.readouterr().out.splitlines()) == 2 + 7


@pytest.mark.parametrize(("ratio", "words"), [(1.75, "1.75"), (1.0004, ""), (1.0, "")])
def test_the_quasi_static_factor_is_named_where_it_is_not_1(ratio, words, capsys):
    design = load_design(SPUR)
    found = replace(speeds_to_avoid(design, "1000:1100:2", starts=0), quasi_static_ratio=ratio)
    answer = DesignAnswer.of(design, found)
    assert any("jumps of the stiffness" in text for text in answer.basis) is bool(words)
    assert ("jumps of the stiffness" in sheet_html([answer])) is bool(words)
    assert at_no_speed(found) == f"dynamic factor {words} at speed 0" * bool(words)
    over = " over the quasi-static ratio" * bool(words)
    criteria = Criteria.checked(0, 0.1, 0, None, factor=1.5, separation=False)
    assert criteria.words(ratio) == f"the dynamic factor{over} exceeds 1.5"
    assert criteria.words(math.nan) == "the dynamic factor exceeds 1.5"
    print_datasheets([answer])
    assert ("over quasi-static" in capsys.readouterr().out) is bool(words)


@pytest.mark.slow
def test_the_ranges_of_the_command_are_those_of_python(tmp_path):
    picture = tmp_path / "k.svg"
    options = ("--speed", "4500:6000:2", "--torque", "900 N*m", "--factor", "0.9")
    found = json.loads(gear(SPUR, *options, "--plot", picture, "--json").stdout)["speeds_to_avoid"]
    expected = speeds_to_avoid(load_design(SPUR), options[1], "900 N*m", factor=0.9, starts=STARTS)
    document = json.loads(json.dumps(expected.document()), parse_constant=lambda _: None)  # null for NaN
    for each in (found, document):
        del each["along_speed"]
    for each in found["ranges"]:  # what follows from the drawing alone
        assert each.pop("root_stress")[0] > each["dynamic_factor"]
    assert found == document and "</svg>" in picture.read_text(encoding="utf-8")
    assert {each["criterion"] for each in found["ranges"]} == {"the teeth separate", "the dynamic factor is too high"}
    text = gear(SPUR, *options, "--all").stdout
    assert text.count("the dynamic factor is") >= sum(
        each["criterion"] == "the dynamic factor is too high" for each in found["ranges"])
    alone = json.loads(gear(SPUR, *options, "--factor-alone", "--json").stdout)["speeds_to_avoid"]
    assert {each["criterion"] for each in alone["ranges"]} == {"the dynamic factor is too high"}


def test_none_is_said_with_what_was_tried():
    result = gear(SPUR, "--speed", "5500:6000:2", "--torque", 1200, "--set", "design.transmission_error=none")
    text = " ".join(result.stdout.split())
    assert text.startswith("at 1200 N m no speed from 5500 to 6000 rpm is to be avoided in operation: none was found "
                           "at which the teeth separate") and "Tried: from rest" in text
    assert "no transmission error" in text and "warning" not in result.stderr


def test_the_torque_of_the_command_is_that_of_the_datasheet():
    by_option, by_set = (json.loads(gear(SPUR, *options, "--json").stdout) for options in (
        ("--set", "torque=3", "--set", "operation.torque=4", "--torque", "250 N*m"), ("--set", "torque=250")))
    assert by_option == by_set and by_option["speeds_to_avoid"] is None


@pytest.mark.parametrize(("arguments", "message"), [
    (("--plot", "x.html", "--speed", "1:2:2"), "--plot must end in"),
    (("--speed", "1:2:2", "--factor", "0"), "--factor must be a finite number"),
    (("--speed", "1:2:2", "--factor-alone"), "--factor-alone needs --factor"),
    (("--speed", "500"), "--speed must read start:stop or start:stop:count; got '500'. E.g. 500:8000 or 500:8000:200."),
    (("--speed", "0:9:3"), "--speed must be greater than 0"), (("--speed", "9:8"), "--speed must run from"),
    (("--speed", "9:9:1"), "--speed must be a range of speeds; got '9:9:1'"),
    (("--torque", ""), "--torque must be a torque"), (("--torque", "60:180"), "--torque must read start:stop:count"),
    (("--torque", "60,x"), "--torque must be a torque; got 'x'"), (("--torque", "x=3"), "--torque must be a torque"),
    (("--torque", "60", "--torque", "60 N*m"), "--torque must be given once; got 60.0"),
    ((*SCAN, "--torque", "60,180", "--plot", "x.png"), "--plot needs a single --torque"),
    (("--json", "--load-change", "5"), "--load-change must be greater than -1, at most 3")])
def test_bad_input_is_refused(arguments, message):
    result = gear(SPUR, *arguments, code=2)
    assert result.stderr.startswith(f"error: {message}") and result.stdout == ""


@pytest.mark.slow
def test_without_load_there_is_no_answer(monkeypatch):
    monkeypatch.setattr("gearchaos.datasheet.answer.default_speeds", lambda design: SCAN[1])  # fewer
    for options in ((), SCAN):
        result = gear(SPUR, "--torque", "0,60", *options, code=2)
        assert result.stderr.splitlines()[-1].startswith("error: torque must be greater than 0")
        assert "60 N m" in result.stdout and "speeds to avoid not computed: see the error" in result.stdout
