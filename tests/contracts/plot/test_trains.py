"""Pictures of trains: their scheme, natural modes, Campbell diagram and flanks in contact."""

import math
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.patches import Annulus, Circle, FancyArrowPatch

import gearchaos as gc
from gearchaos import plot
from gearchaos.errors import InputError
from gearchaos.gears.train.planets import PlanetarySet
from tests import EXAMPLES

STEPS = {"levels": [3e8, 2e8], "starts": [0.0, 0.6]}


def mesh(a: str, b: str, z1: int, z2: int, **values: Any) -> gc.Mesh:
    return gc.Mesh(between=(a, b), teeth=(z1, z2), base_radii=(z1 * 1.5e-3, z2 * 1.5e-3),
                   **{"stiffness": STEPS, "damping": 900.0, "backlash": 6e-5, **values})


def two_stages() -> gc.Train:
    bodies = [gc.Body(name="motor", inertia=8e-3, torque=40.0, torque_orders=[{"order": 2, "amplitude": 10.0}]),
              gc.Body(name="pinion", inertia=3e-4), gc.Body(name="wheel", inertia=6e-3),
              gc.Body(name="second", inertia=6e-4), gc.Body(name="load", inertia=2e-2, torque=-180.0)]
    shafts = [gc.Shaft(between=between, stiffness=1e4) for between in (("motor", "pinion"), ("wheel", "second"))]
    return gc.Train(speed=3000, bodies=bodies, shafts=shafts,
                    meshes=[mesh("pinion", "wheel", 20, 40, name="stage 1"), mesh("second", "load", 24, 54)])


def idler() -> gc.Train:
    bodies = [gc.Body(name="driver", inertia=8e-3, torque=40.0), gc.Body(name="idler", inertia=3e-3),
              gc.Body(name="load", inertia=2e-2, torque=-108.0)]
    return gc.Train(speed=3000, bodies=bodies, meshes=[mesh("driver", "idler", 20, 40), mesh("idler", "load", 40, 54)])


def planetary() -> gc.Train:
    values = {"stiffness": 5e8, "backlash": 1e-4}
    found = PlanetarySet(count=3, teeth=(27, 36, 99), module="2.8 mm", sun={"inertia": 5e-4, "torque": 30.0},
                         ring={"fixed": True}, carrier={"inertia": 5e-2, "torque": -140.0},
                         planet={"mass": 0.66, "inertia": 5e-4}, sun_mesh={**values, "stiffness": STEPS},
                         ring_mesh=values)
    return gc.Train(speed=1500, bodies=found.bodies, meshes=found.meshes)


def split() -> gc.Train:
    bodies = [gc.Body(name=name, inertia=1e-3) for name in ("in", "a1", "b1", "a2", "b2", "out")]
    return gc.Train(speed=3000, bodies=bodies, shafts=[
        gc.Shaft(between=(f"a{i}", f"b{i}"), stiffness=1e4) for i in (1, 2)], meshes=[
        mesh("in", "a1", 20, 40), mesh("in", "a2", 20, 40), mesh("b1", "out", 18, 50), mesh("b2", "out", 18, 50)])


def circles(ax: Any) -> dict[str, Circle]:
    """The circle in which each name is written."""
    found = {}
    for text in ax.texts:
        for patch in [p for p in ax.patches if isinstance(p, Circle) and p.get_fill()]:
            if math.dist(patch.center, text.get_position()) < 0.2 * patch.radius:
                found.setdefault(text.get_text().split("\n")[0], patch)
    return found


def test_the_scheme_names_bodies_with_teeth_and_speeds_and_wheels_that_mesh_touch():
    ax = plot.train(two_stages())
    texts = [text.get_text() for text in ax.texts]
    assert {"motor\n3000 rpm", "pinion\nz 20\n3000 rpm", "wheel\nz 40\n1500 rpm", "load\nz 54\n666.7 rpm",
            "stage 1"} <= set(texts)
    assert "second/load" not in texts, "a name that was not given"
    found = circles(ax)
    for a, b in (("pinion", "wheel"), ("second", "load")):
        assert math.dist(found[a].center, found[b].center) == pytest.approx(found[a].radius + found[b].radius)
    for a, b in (("motor", "pinion"), ("wheel", "second"), ("motor", "wheel"), ("motor", "load"), ("pinion", "load")):
        assert math.dist(found[a].center, found[b].center) > found[a].radius + found[b].radius
    assert found["pinion"].radius < found["second"].radius < found["wheel"].radius


def test_arrows_point_in_the_sense_of_rotation():
    ax, train = plot.train(two_stages()), two_stages()
    found = circles(ax)
    arrows = [patch for patch in ax.patches if isinstance(patch, FancyArrowPatch)]
    assert len(arrows) == len(train.bodies)
    for name, circle in found.items():
        ends = [arrow._posA_posB for arrow in arrows]  # matplotlib has no other way to read them
        start, end = min(ends, key=lambda both: math.dist(both[0], circle.center) + math.dist(both[1], circle.center))
        (x, y) = circle.center
        turn = (start[0] - x) * (end[1] - y) - (start[1] - y) * (end[0] - x)
        assert turn * train.speeds[name] > 0


def test_names_of_the_meshes_of_planets_are_not_written():
    ax = plot.train(gc.open(EXAMPLES / "train_wind_turbine.toml"))
    written = [text.get_text() for text in ax.texts]
    assert "high" in written and not any("/" in text for text in written)


def test_planets_stand_around_their_sun_inside_a_hatched_ring_that_is_held():
    ax = plot.train(planetary())
    found, (ring,) = circles(ax), [patch for patch in ax.patches if isinstance(patch, Annulus)]
    assert ring.get_hatch()
    sun, inner = found["sun"], ring.get_radii()[0] - ring.get_width()
    for n in (1, 2, 3):
        planet = found[f"planet{n}"]
        assert math.dist(planet.center, sun.center) == pytest.approx(sun.radius + planet.radius)
        assert math.dist(planet.center, sun.center) == pytest.approx(inner - planet.radius)
        angle = math.atan2(planet.center[1] - sun.center[1], planet.center[0] - sun.center[0])
        assert math.remainder(angle - 2 * math.pi * (n - 1) / 3, 2 * math.pi) == pytest.approx(0, abs=1e-9)
    texts = [text.get_text() for text in ax.texts]
    assert "ring\nz 99\nheld" in texts and "carrier\n321.4 rpm" in texts
    with plot.style("dark"):
        assert all(to_hex(text.get_color()) > "#888888" for text in plot.train(planetary()).texts)


def test_a_loop_that_does_not_close_in_the_plane_is_drawn_and_a_prescribed_motion_is_broken():
    assert set(circles(plot.train(split()))) == {"in", "a1", "b1", "a2", "b2", "out"}
    train = gc.Train(speed=100, bodies=[gc.Body(name="a", motion=[]), gc.Body(name="b", inertia=1e-3)],
                     meshes=[mesh("a", "b", 20, 20)])
    found = circles(plot.train(train))
    assert found["a"].get_linestyle() != found["b"].get_linestyle()


def test_the_texts_of_a_scheme_of_80_mm_stay_within_their_wheels():
    for train in (two_stages(), planetary(), split()):
        with plot.style("paper", width=80):
            ax = plot.train(train)
            ax.figure.draw_without_rendering()
            for name, circle in circles(ax).items():
                text = next(t for t in ax.texts if t.get_text().split("\n")[0] == name)
                box, outer = text.get_window_extent(), circle.get_window_extent()
                assert box.width < outer.width and box.height < outer.height
                assert text.get_fontsize() >= 4.5


def test_dots_of_a_campbell_diagram_are_where_orders_have_natural_frequencies():
    ds = gc.natural_frequencies(two_stages())
    ax = plot.campbell(ds, harmonics=2, speed=4000)
    frequency = ds.natural_frequency.values[~ds.rigid.values]
    dots = np.concatenate([line.get_xydata() for line in ax.lines if line.get_marker() == "o"])
    expected = [(60 * f / order, f) for order in (20, 40, 12, 24, 2) for f in frequency]
    expected = [point for point in expected if point[0] <= 4000 and point[1] <= ax.get_ylim()[1]]
    assert len(dots) == len(expected) > 5
    np.testing.assert_allclose(sorted(map(tuple, dots)), sorted(expected))
    assert {t.get_text() for t in ax.get_legend().get_texts()} == {
        "20: mesh stage 1", "12: mesh second/load", "2: order 2 of motor", "natural frequency"}
    ax = plot.campbell(gc.natural_frequencies(planetary()), harmonics=1)  # meshes of one order are one line
    assert [t.get_text() for t in ax.get_legend().get_texts()] == [
        "21.214: mesh sun/planet1 and 5 more", "natural frequency"]


def test_cells_of_modes_have_the_energies_with_the_signs_of_the_angles():
    bodies = [gc.Body(name=name, inertia=1e-3) for name in ("a", "idler", "b")]
    train = gc.Train(speed=600, bodies=bodies, meshes=[
        mesh("a", "idler", 20, 20, stiffness=2e8), mesh("idler", "b", 20, 20, stiffness=2e8)])
    ax = plot.modes(gc.natural_frequencies(train), most=3)
    cells = {(text.get_position()[0] - 0.5, text.get_position()[1] - 0.5): text.get_text() for text in ax.texts[2:]}
    assert [cells[column, 2] for column in range(3)] == ["−17", "+67", "−17"]
    assert [cells[column, 2] for column in (4, 5)] == ["50", "50"]
    assert [cells[column, 0] for column in range(3)] == ["+33"] * 3
    assert ax.get_yticklabels()[0].get_text() == "turning as a whole"


def test_strips_show_which_flanks_touch():
    ds = gc.simulate(idler(), 2, samples=64)
    ax = plot.flanks(ds)
    (strips,) = ax.collections[:1]
    assert strips.get_array().reshape(2, -1).tolist() == ds.contact.values.T.tolist()
    colours = {code: to_hex(strips.cmap(strips.norm(code))) for code in (-1, 0, 1)}
    labels = {t.get_text(): to_hex(p.get_facecolor()) for t, p in zip(
        ax.get_legend().get_texts(), ax.get_legend().get_patches(), strict=True)}
    assert labels == {"front flanks": colours[1], "apart": colours[0], "back flanks": colours[-1]}


def test_pictures_refuse_what_they_cannot_draw():
    ds = gc.natural_frequencies(two_stages())
    with pytest.raises(InputError, match="must be a Train"):
        plot.train(gc.MeshModel())
    with pytest.raises(InputError, match="campbell or modes"):
        plot.flanks(ds)
    with pytest.raises(InputError, match="harmonics"):
        plot.campbell(ds, harmonics=0)
    motion = gc.simulate(idler(), 2)
    for draw in (plot.campbell, plot.modes, plot.flanks):
        with pytest.raises(InputError, match="must be a result of"):
            draw(motion)


def test_a_campbell_diagram_is_drawn_from_its_file(tmp_path):
    ax = plot.campbell(gc.natural_frequencies(two_stages()))
    _, file = plot.save_with_data(ax, tmp_path / "campbell.svg")
    assert plot.result(gc.load(file)).axes[0].get_ylim() == ax.get_ylim()
