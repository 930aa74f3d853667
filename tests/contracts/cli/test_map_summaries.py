"""What maps print, and what pictures of given gears show without being asked: the contact of the teeth."""

import numpy as np
import pytest

import gearchaos as gc
from gearchaos import plot
from gearchaos.cli.summaries import print_attractors
from gearchaos.datasets import with_primes
from gearchaos.gears.geometry.root_stress import root_stress
from gearchaos.gears.io.units import measured
from gearchaos.gears.operation.operating import gears_from_json
from tests import ONE_SPRING
from tests.commands import ask, run_json
from tests.contracts.model.test_damping_law import PAIR
from tests.pictures import legend_words

SPUR = ONE_SPRING
MAP = ("map", SPUR, "--speed", "1500:4500:7", "--torque", "60:400:4")


def test_a_map_of_gears_prints_contact_and_the_largest_factor(tmp_path):
    document = run_json(*MAP, "--out", tmp_path / "m.nc")
    found, lines = gc.load(tmp_path / "m.nc"), ask(*MAP, "--out", tmp_path / "m.nc").stdout.splitlines()
    share = 100 * float((found.contact == 0).mean())
    where = found.dynamic_factor.stack(cell=found.dynamic_factor.dims)
    speed, torque = (float(where[int(where.argmax("cell"))][n]) for n in ("speed", "torque"))
    both = 100 * float((found.contact == 2).mean())
    assert 0 < share < 100 and 0 < both < 100
    said, third = " ".join(map(str.strip, lines[:-1])), lines[-1]
    first, second = said.split(" largest ")
    assert first.startswith(f"teeth, one motion each: in contact {share:.3g} %, separate ")
    assert first.endswith(f", hit both flanks {both:.3g} % of the cells")
    stress = float(where.max()) * max(root_stress(gears_from_json(found.attrs["gears"]).geometry, torque)) / 1e6
    assert second == (f"dynamic factor {float(where.max()):.4g} (root {measured(stress, 3)} N/mm²), at speed "
                      f"{speed:.4g} rpm, torque {torque:.4g} N m")
    assert third == "dynamic factor: mesh damping in contact alone, quasi-static ratio 1.75"
    assert document["contact"]["permanent"] == int((found.contact == 0).sum())
    assert document["largest"] == {
        "quantity": "dynamic_factor", "value": float(where.max()), "at": {"speed": speed, "torque": torque}}


def test_of_several_motions_the_largest_factor_says_which_has_it(tmp_path):
    lines = ask(*MAP, "--starts", 2, "--out", tmp_path / "m.nc").stdout.splitlines()
    found = gc.load(tmp_path / "m.nc")
    share = 100 * float((found.contact_worst == 2).mean())
    assert lines[0].startswith("teeth: ") and f"hit both flanks {share:.3g} %" in lines[0]
    largest = float(found.dynamic_factor.max())
    words = " ".join(" ".join(lines[1:-1]).split())
    first, rest = next(line for line in lines if "largest" in line).split(" (root ")
    operation, alone = (100 * float(code.mean()) for code in (
        (found.to_avoid > 0) & (found.to_avoid < 5), found.to_avoid > 4))
    led = 100 * float(found.share_of_load_changes.mean())
    assert words.startswith(f"to avoid: {operation:.3g} % of the cells in operation, ")
    assert f"{alone:.3g} % reached by load changes alone; {led:.3g} % of the load" in words
    assert first == f"largest dynamic factor {largest:.4g}" and " N/mm²) (initial values), at speed" in rest
    assert max(map(len, lines)) <= 80


@pytest.mark.parametrize(("arguments", "first", "second"), [
    (("zones", "--axis", "omega=0.5:1.5:6", "--axis", "eps1=0:0.3:5"), "motions: 1T ", "largest dynamic factor"),
    (("bifurcation", "--axis", "eps1=0:0.3:5"), "motions: ", "largest dynamic factor "),
    (("bifurcation", "--set", "q0=0", "--axis", "eps1=0:0.3:5"), "motions: ", "largest V_RMS "),
    (("bifurcation", SPUR, "--set", "torque=100", "--axis", "speed=2000:3000:3"), "teeth, one motion each: ",
     "largest dynamic factor"),
    (("basins", "--set", "kind=single", "--set", "omega=0.8", "--set", "eps1=0.1", "--axis", "z=-3:3:6", "--axis",
      "z_dot=-2:2:6"), "basins: 1T ", "basin entropy ")])
def test_lines_that_fit_a_terminal(tmp_path, arguments, first, second):
    """Two, and a third that says what a dynamic factor is read with."""
    lines = ask(*arguments, "--out", tmp_path / "x.nc").stdout.splitlines()
    assert max(map(len, lines)) <= 80
    assert lines[0].startswith(first) and lines[1].startswith(second)
    factors = "largest dynamic factor" in second
    assert len(lines) == 2 + factors
    assert lines[-1].startswith("dynamic factor: mesh damping ") == factors


def test_the_line_of_many_motions_is_cut(capsys):
    from gearchaos.cli.summaries import _print_shares

    many = [(f"{n}T", 0.1) for n in range(1, 31)]
    _print_shares("motions", many, "cells")
    _print_shares("motions", many[:4], "cells")
    cut, whole = capsys.readouterr().out.splitlines()
    assert len(cut) <= 80 < len(cut + ", 30T 10 %") and cut.endswith("%, … of the cells")
    assert whole == "motions: 1T 10 %, 2T 10 %, 3T 10 %, 4T 10 % of the cells"


def test_pictures_of_maps_of_gears_show_contact():
    found = gc.operating_map(PAIR, "2000:14000:5", "20:180:4")
    by_default, asked, motion = (plot.result(found, colour).axes[0] for colour in (None, "contact", "motion"))
    shown, wanted, other = (np.asarray(ax.images[0].get_array()) for ax in (by_default, asked, motion))
    np.testing.assert_array_equal(shown, wanted)
    np.testing.assert_array_equal(shown, found.contact.values)
    assert not np.array_equal(shown, other) and "separation" in legend_words(by_default)
    several = gc.operating_map(PAIR, "2000:14000:5", "20:180:4", starts=4)
    worst = np.asarray(plot.result(several).axes[0].images[0].get_array())
    np.testing.assert_array_equal(worst, several.to_avoid.values)
    wide = gc.operating_map(PAIR, "2000:14000:5", "20:180:4", starts=4, wide=True)
    worst = np.asarray(plot.result(wide).axes[0].images[0].get_array())
    np.testing.assert_array_equal(worst, wide.contact_worst.values)
    dimensionless = gc.zones(gc.MeshModel.of(q0=0.1), "omega=0.9:1.1:3", "eps1=0:0.3:3")
    image = np.asarray(plot.result(dimensionless).axes[0].images[0].get_array())
    np.testing.assert_array_equal(image, plot.motion_class(dimensionless.label, dimensionless.period))


def test_motions_of_the_same_kind_are_told_apart(capsys):
    model = gc.MeshModel.of(kind="single", omega=0.7, q0=0.1, eps1=0.05)
    print_attractors(gc.attractors(model, starts=16, sweep="omega=0.6:0.8:2"), model)
    rows = [line.split()[0] for line in capsys.readouterr().out.splitlines() if line.startswith("1T")]
    assert rows == ["1T", "1T′"]
    assert with_primes(["4T", "chaotic", "4T", "4T"]) == ["4T", "chaotic", "4T′", "4T′′"]


@pytest.mark.parametrize(("kind", "velocity"), [("torsional", "x1'"), ("single", "z'")])
def test_the_velocity_is_that_of_the_model(kind, velocity):
    assert f"V_RMS, rms of {velocity}  " in ask("regime", "--set", f"kind={kind}").stdout
