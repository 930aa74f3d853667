"""The scheme of a train in the explorer, without a browser: its parts, places of labels, modes, verdicts of meshes."""

import json
import math
import re
from itertools import combinations

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.explorer.features.train.scheme import APART, mesh_verdicts, scheme
from gearchaos.explorer.web.messages import render
from gearchaos.plot._train import Scheme
from gearchaos.studyfile import load_study
from tests import EXAMPLES

TRAINS = {path.stem: load_study(path).gears for path in sorted(EXAMPLES.glob("train_*.toml"))}


@pytest.mark.parametrize("name", TRAINS)
def test_no_label_lies_upon_another_and_all_are_in_the_picture(name):
    found = scheme(TRAINS[name])
    labels = [mark.label for mark in (*found.bodies, *found.meshes)]
    assert len(labels) == len(TRAINS[name].bodies) + len(TRAINS[name].meshes)
    assert min(math.dist(*pair) for pair in combinations(labels, 2)) >= APART - 2e-3
    assert all(1.5 < x < 98.5 and 1.5 < y < found.height - 1.5 for x, y in labels)


@pytest.mark.parametrize("name", TRAINS)
def test_wheels_touch_at_their_meshes_and_have_their_words(name):
    train, found = TRAINS[name], scheme(TRAINS[name])
    marks = {mark.name: mark for mark in found.bodies}
    assert [mark.words.partition(":")[0] for mark in found.bodies] == [body.name for body in train.bodies]
    for mesh, mark in zip(train.meshes, found.meshes, strict=True):
        assert mark.words.startswith(f"{mesh.name}: {mesh.teeth[0]}/{mesh.teeth[1]} teeth")
        for end, body in () if mesh.internal else zip(mark.ends, mesh.between, strict=True):
            distance = math.dist(end, marks[body].centre)
            assert min(abs(distance - radius) for radius, _ in marks[body].circles) < 0.01


def test_modes_turn_bodies_as_their_angles_say_and_planets_go_with_their_carrier():
    train = TRAINS["train_planetary"]
    found, modes = scheme(train), gc.natural_frequencies(train)
    modes = modes.isel(mode=~modes["rigid"].values)
    shapes = json.loads(found.shapes)
    assert len(shapes) == len(found.modes) == modes.sizes["mode"]
    senses = np.sign([train.speeds[name] or 1.0 for name in modes["body"].values])
    centres = {mark.name: np.array(mark.centre) for mark in found.bodies}
    for shape, words, number in zip(shapes, found.modes, range(len(shapes)), strict=True):
        mode = modes.isel(mode=number)
        assert float(words.partition(" Hz")[0]) == pytest.approx(float(mode["natural_frequency"]), rel=5e-3)
        turned = np.array([shape[name][0] for name in modes["body"].values])  # clockwise, since down is up
        angle = -senses * mode["mode_angle"].values
        largest = np.abs(angle).max()
        assert turned == pytest.approx(angle * np.abs(turned).max() / largest, abs=2e-3)  # of three decimals
        assert np.abs(turned).max() <= 20 + 1e-3
        scale = np.abs(turned).max() / np.degrees(largest)
        for name in ("planet1", "planet2", "planet3"):
            x, y = centres[name] - centres["carrier"]
            taken = math.radians(shape["carrier"][0]) * np.array([-y, x])
            pin = mode.sel(body=name)
            size = math.hypot(x, y) / Scheme(train).orbit(train.body(name))
            if scale > 1e-3:
                own = scale * size * np.array([float(pin["mode_x"]), -float(pin["mode_y"])])
                assert shape[name][1:] == pytest.approx(taken + own, abs=0.02)


def test_the_page_lists_all_parts_with_a_button_for_each_body_and_mesh():
    train = TRAINS["train_two_stage"]
    html = render("features/train/scheme.html.j2", scheme=scheme(train))
    assert html.count("<svg") == 1 and html.count("<button data-part") == 6 and scheme(train) is scheme(train)
    for words in ("motor:", "drum:", "second: 20/50 teeth", "wheel-pinion: 5e+04 N m/rad", "Hz, ζ "):
        assert words in html


def test_verdicts_of_meshes_are_their_rows_in_words():
    found = mesh_verdicts([("a/b", "one-sided", "93.1%", "0.0%", "2013", "120", "1.9")])
    assert found["a/b"]["contact"] == "one-sided" and found["a/b"]["words"] == (
        "one-sided, front flanks 93.1%, back flanks 0.0% of the time, peak 2013 N, 120 impacts/s, dynamic factor 1.9")
    assert "peak 2013 kN," in mesh_verdicts([("a/b", "none", "0.0%", "0.0%", "2013", "0", "–")], "kN")["a/b"]["words"]


def test_modes_have_the_speeds_at_which_mesh_frequencies_meet_them():
    train = TRAINS["train_two_stage"]
    frequency = float(gc.natural_frequencies(train).natural_frequency[1])
    assert scheme(train).modes[0].endswith(  # of 20 teeth, and of 20 on a wheel half as fast
        f", met at {60 * frequency / 20:.0f} (A), {60 * frequency / 10:.0f} (B) rpm of motor")
    assert scheme(TRAINS["train_planetary"]).modes[0].endswith(" rpm of sun") and "(A)" not in (
        scheme(TRAINS["train_planetary"]).modes[0])
    met = scheme(TRAINS["train_wind_turbine"]).modes[0].partition("met at ")[2]
    assert re.fullmatch(r"\d+ \(A\), \d+ \(B\), \d+ \(H\) rpm of generator", met)  # the first mesh of each frequency
    html = render("features/train/scheme.html.j2", scheme=scheme(train))
    assert html.count(" rpm of motor</li>") == len(scheme(train).modes) and ">1: 570 Hz, ζ 0.059</option>" in html
