"""Two results in one picture: curves of events over a map, and a sweep over another."""

import json
from pathlib import Path

import numpy as np
import pytest

import gearchaos as gc
from gearchaos import plot
from gearchaos.errors import InputError
from tests.commands import ask, refused

MODEL = gc.MeshModel.of(kind="single", zeta=0.025, q0=0.1, eps1=0.05)
PLANE = ("omega=0.5:1.1:12", "eps1=0.03:0.08:8")


@pytest.fixture(scope="module")
def results():
    up, down = (gc.bifurcation(MODEL, "omega=0.5:1.1:40", mode=mode, points=0) for mode in ("up", "down"))
    return {"map": gc.zones(MODEL, *PLANE), "up": up, "down": down,
            "curve": gc.curve(MODEL, "fold", "omega=0.5:1.1", "eps1=0.03:0.08", period=1)}


def test_a_curve_over_a_map(results):
    ax = plot.result(results["map"], over=results["curve"]).axes[0]
    assert len(ax.images) == 1
    drawn, curve = ax.lines[0], results["curve"]
    np.testing.assert_array_equal(drawn.get_xdata(), curve.omega.values)
    np.testing.assert_array_equal(drawn.get_ydata(), curve.eps1.values)
    assert ax.get_xlim() == plot.zones(results["map"]).get_xlim()  # those of the map


def test_a_sweep_over_another(results):
    ax = plot.result(results["up"], "v_rms", over=results["down"]).axes[0]
    for line, name in zip(ax.lines[:2], ("up", "down"), strict=True):
        np.testing.assert_array_equal(line.get_ydata(), results[name].v_rms.values)
    assert (results["up"].v_rms != results["down"].v_rms).any()  # there is a jump in each
    assert [t.get_text() for t in ax.get_legend().get_texts()] == ["sweep up", "sweep down"]
    assert ax.lines[0].get_color() != ax.lines[1].get_color()
    low, high = ax.get_ylim()
    both = np.concatenate([results[n].v_rms.values for n in ("up", "down")])
    assert low <= both.min() and both.max() <= high
    default = plot.result(results["up"], over=results["down"]).axes[0]
    np.testing.assert_array_equal(default.lines[1].get_ydata(), results["down"].dynamic_factor.values)


@pytest.mark.parametrize(("below", "over", "words"), [
    ("map", "up", "must be a skeleton or curve over a map"), ("curve", "map", "must be a skeleton or curve over a map"),
    ("up", "map", "must have the study of the result below")])
def test_results_that_do_not_belong_together(results, below, over, words):
    with pytest.raises(InputError, match=words):
        plot.result(results[below], over=results[over])


def test_other_parameters_and_units(results):
    other = gc.zones(MODEL, "omega=0.5:1.1:3", "q0=0.1:0.2:2")
    with pytest.raises(InputError, match="must have the parameters"):
        plot.result(other, over=results["curve"])
    turned = results["curve"].copy()
    turned["omega"] = turned.omega.assign_attrs(units="Hz")
    with pytest.raises(InputError, match="must have the units"):
        plot.result(results["map"], over=turned)
    with pytest.raises(InputError, match="must be a number where two diagrams"):
        plot.result(results["up"], "contact", over=results["down"])


@pytest.mark.slow
def test_the_command(results, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("map", "curve", "up"):
        gc.save(results[name], f"{name}.nc")
    assert "wrote" in ask("plot", "map.nc", "--over", "curve.nc").stderr and Path("map_with_curve.png").exists()
    assert "over must be a skeleton or curve" in refused("plot", "map.nc", "--over", "up.nc")
    assert json.loads(gc.load("up.nc").attrs["settings"])["mode"] == "up"
