"""The drawing of a gear pair: flanks that touch and do not overlap, circles and the path of contact to scale."""

import math
from functools import cache

import numpy as np
import pytest
from matplotlib.patches import Polygon
from matplotlib.path import Path

import gearchaos as gc
from gearchaos import plot
from gearchaos.errors import InputError
from gearchaos.gears.design.transverse_section import FILLET_POINTS, FLANK_POINTS, TransverseSection, transverse_section
from gearchaos.gears.stiffness.potential_energy import tooth_profile
from tests.branches import axes
from tests.contracts.plot.figures import cut

pytestmark = pytest.mark.slow

BACKLASH = {"value": "0.12 mm", "of": "line of action, total"}
DESIGNS = {
    "17/103 helical": {
        "teeth": (17, 103), "module": "8 mm", "helix_angle": "15.8 deg", "face_width": "100 mm",
        "centre_distance": "500 mm", "profile_shift": (0.145, 0.0), "tip_diameter": ("159.66 mm", "872.35 mm"),
        "rack": {"addendum": 1.0, "dedendum": 1.4, "root_radius": 0.39}, "backlash": BACKLASH},
    "62/62": {"teeth": (62, 62), "module": "2 mm", "face_width": "20 mm"},
    "12/40 shifted": {"teeth": (12, 40), "module": "3 mm", "face_width": "20 mm", "profile_shift": (0.4, -0.1),
                      "backlash": BACKLASH},
    "40/12 speeding up": {"teeth": (40, 12), "module": "3 mm", "face_width": "20 mm", "profile_shift": (-0.1, 0.4),
                          "backlash": BACKLASH},
    "14/30 undercut": {"teeth": (14, 30), "module": "3 mm", "face_width": "20 mm",
                       "tip_alteration": ("0 mm", "-0.9 mm"), "backlash": BACKLASH},
    "119/18 with thin tips": {
        "teeth": (119, 18), "module": "2.5 mm", "face_width": "20 mm", "profile_shift": (-0.1, 0.95),
        "rack": {"addendum": 1.1, "dedendum": 1.35, "root_radius": 0.2}, "tip_alteration": "keep clearance",
        "backlash": {"value": "0.37 mm", "of": "line of action, total"}},
    "9/9": {"teeth": (9, 9), "module": "3 mm", "face_width": "20 mm", "profile_shift": (0.5, 0.5),
            "tip_alteration": "keep clearance"}}
TOLERANCE = 1e-9
"""Length in m by which flanks may miss each other or overlap."""


DAILY = ("17/103 helical", "40/12 speeding up", "14/30 undercut", "119/18 with thin tips")


@pytest.fixture(params=[
    pytest.param(name, marks=[] if name in DAILY else [pytest.mark.exhaustive]) for name in DESIGNS])
def name(request) -> str:
    return request.param


@pytest.fixture
def design(name) -> gc.GearDesign:
    return gc.GearDesign(**DESIGNS[name])


@cache
def drawn(name: str, **options):
    """The picture of a pair, which no test changes."""
    return plot.gear_pair(gc.GearDesign(**DESIGNS[name]), axes(), **options)


def polygons(ax) -> list[np.ndarray]:
    """The closed outlines (corners, 2), in m, of the two wheels in a panel."""
    return [p.get_xy() * 1e-3 for p in ax.patches if isinstance(p, Polygon)]


def distances(points: np.ndarray, outline: np.ndarray) -> np.ndarray:
    """Distances of points (P, 2) from a polygon's boundary (corners, 2)."""
    start, edge = outline[:-1], np.diff(outline, axis=0)
    keep = (edge**2).sum(axis=1) > 0
    start, edge = start[keep], edge[keep]
    share = np.clip(((points[:, None] - start) * edge).sum(axis=2) / (edge**2).sum(axis=1), 0, 1)
    return np.hypot(*np.moveaxis(points[:, None] - start - share[..., None] * edge, 2, 0)).min(axis=1)


def overlap(first: np.ndarray, second: np.ndarray) -> float:
    """How deep corners of either polygon lie within the other one."""
    depths = [0.0]
    for points, outline in ((first, second), (second, first)):
        inside = points[Path(outline).contains_points(points)]
        depths += distances(inside, outline).tolist() if len(inside) else []
    return max(depths)


@pytest.mark.parametrize("phase", [
    None, 0.77, *(pytest.param(phase, marks=pytest.mark.exhaustive) for phase in (0.0, 0.31, 0.999))])
def test_flanks_of_the_drawing_touch_and_do_not_overlap(name, design, phase):
    close, whole = drawn(name, phase=phase).child_axes
    section = transverse_section(design, phase)
    first, second = polygons(close)
    assert overlap(first, second) < TOLERANCE
    assert len(section.contacts) - design.geometry.contact_ratio == pytest.approx(0, abs=1)
    for contact in section.contacts:
        point = section.on_line(contact)[None]
        assert max(distances(point, first)[0], distances(point, second)[0]) < TOLERANCE
    assert overlap(*polygons(whole)) < TOLERANCE


def test_the_backlash_is_the_distance_of_the_back_flanks(design):
    """Wheel 2, turned ahead by the backlash, touches with its other flanks; turned by more, or back, it overlaps."""
    section = transverse_section(design)
    outlines = [section.outline(wheel, range(-2, 3), detail=20) for wheel in (0, 1)]
    centre, base = section.centres[1], design.geometry.base_diameter[1] / 2

    def turned(length: float) -> np.ndarray:
        sine, cosine = math.sin(length / base), math.cos(length / base)
        return (outlines[1] - centre) @ np.array([[cosine, sine], [-sine, cosine]]) + centre

    beyond = 1e-4 * design.module
    assert overlap(outlines[0], turned(section.backlash)) < TOLERANCE
    assert overlap(outlines[0], turned(section.backlash + beyond)) == pytest.approx(beyond, rel=0.1)
    assert overlap(outlines[0], turned(-beyond)) == pytest.approx(beyond, rel=0.1)


def test_path_of_contact_runs_between_the_tip_circles(design):
    section, g = transverse_section(design), design.geometry
    start, end = section.on_line(section.start), section.on_line(section.end)
    assert np.hypot(*(start - section.centres[1])) == pytest.approx(g.tip_diameter[1] / 2, rel=1e-12)
    assert np.hypot(*end) == pytest.approx(g.tip_diameter[0] / 2, rel=1e-12)
    assert np.hypot(*(end - start)) == pytest.approx(g.path_of_contact, rel=1e-12)
    tangency = section.on_line(0.0), section.on_line(g.tangent_length)
    assert np.hypot(*tangency[0]) == pytest.approx(g.base_diameter[0] / 2, rel=1e-12)
    assert np.hypot(*(tangency[1] - section.centres[1])) == pytest.approx(g.base_diameter[1] / 2, rel=1e-12)
    along = section.pitch_point - tangency[0]
    assert along @ section.direction == pytest.approx(np.hypot(*along), rel=1e-12)


def test_teeth_have_their_thickness_and_their_radii(design):
    """The tooth thickness on the reference circle is that of ISO 21771 (39), less half the excess backlash."""
    section, g = transverse_section(design), design.geometry
    for wheel in (0, 1):
        points = section.outline(wheel, range(1), detail=40) - section.centres[wheel]
        radius, angle = np.hypot(*points.T), np.unwrap(np.arctan2(points[:, 1], points[:, 0]))
        assert radius.max() == pytest.approx(g.tip_diameter[wheel] / 2, rel=1e-12)
        assert radius.min() == pytest.approx(g.root_diameter[wheel] / 2, rel=1e-12)
        half = len(radius) // 2
        reference = g.reference_diameter[wheel] / 2
        rising = np.interp(reference, radius[:half], angle[:half])
        falling = np.interp(reference, radius[half:][::-1], angle[half:][::-1])
        excess = section.backlash - g.theoretical_backlash
        if g.tip_thickness[1] < 0.1e-3:  # the other wheel has the rest
            continue
        thickness = g.transverse_module * (math.pi / 2 + 2 * g.profile_shift[wheel] * math.tan(g.pressure_angle))
        thickness -= excess / 2 / math.cos(g.transverse_pressure_angle)
        assert (falling - rising) * reference == pytest.approx(thickness, abs=2e-6 * g.normal_module)


def test_both_panels_are_to_scale(name, design):
    ax = drawn(name, phase=None)
    ax.figure.canvas.draw()
    for panel in ax.child_axes:
        box = panel.get_window_extent()
        assert np.ptp(panel.get_xlim()) / np.ptp(panel.get_ylim()) == pytest.approx(box.width / box.height, rel=1e-6)
    whole = ax.child_axes[1]
    assert drawn(name, teeth=None).child_axes == [] and len(polygons(drawn(name, teeth=None))) == 2
    assert f"{1e3 * design.geometry.centre_distance:.6g} mm" in whole.texts[-1].get_text()


@pytest.mark.parametrize("size", [(13.6, 6), (3.4, 2.8), *(
    pytest.param(size, marks=pytest.mark.exhaustive) for size in ((6.4, 4.8), (3.9, 4.8)))], ids=str)
def test_no_text_is_cut_or_lies_over_another_one(design, size):
    ax = plot.gear_pair(design, axes(*size))
    assert cut(ax.figure) == []
    assert ax.child_axes[0].get_window_extent().width > 0.25 * ax.figure.bbox.width
    found = [t for panel in ax.child_axes for t in panel.texts if t.get_text()]
    found += [label for panel in ax.child_axes if panel.axison for label in (panel.xaxis.label, panel.yaxis.label)]
    boxes = [(t.get_text(), t.get_window_extent()) for t in found]
    pairs = [(a, b) for i, (a, one) in enumerate(boxes) for b, other in boxes[:i] if one.padded(-1).overlaps(other)]
    assert pairs == []


def test_the_arrows_of_rotation_cross_no_teeth(name):
    whole = drawn(name, phase=None).child_axes[1]
    outlines = [Path(polygon) for polygon in polygons(whole)]
    arrows = [1e-3 * np.column_stack(line.get_data()) for line in whole.lines if 20 < len(line.get_xdata()) < 40]
    assert len(arrows) == 2
    for arrow in arrows:
        assert all(len(set(outline.contains_points(arrow).tolist())) == 1 for outline in outlines)
        for values, limits in zip(1e3 * arrow.T, (whole.get_xlim(), whole.get_ylim()), strict=True):
            assert limits[0] < values.min() and values.max() < limits[1]


def test_circles_are_drawn_in_one_order_and_reference_circles_only_where_they_differ():
    """The same pixels in every process: circles of nearly the same radius overlap."""
    ax = drawn("12/40 shifted")
    colours = {line.get_label(): line.get_color() for line in ax.get_legend().get_lines()}
    names = [f"{name} circles" for name in ("tip", "pitch", "reference", "base")]
    assert [line.get_color() for line in ax.child_axes[0].lines[:8:2]] == [colours[name] for name in names]
    assert "reference circles" not in [t.get_text() for t in drawn("62/62").get_legend().get_texts()]


@pytest.mark.parametrize(("arguments", "field"), [
    ({"design": gc.MeshModel()}, "design"), ({"teeth": 0}, "teeth"), ({"teeth": 0.1}, "teeth"),
    ({"teeth": "many"}, "teeth"), ({"phase": math.nan}, "phase")])
def test_what_cannot_be_drawn_is_refused(arguments, field):
    with pytest.raises(InputError) as error:
        plot.gear_pair(**{"design": gc.GearDesign(**DESIGNS["62/62"]), "ax": axes(), **arguments})
    assert error.value.field == field


def test_wheels_with_many_teeth_are_drawn_as_discs():
    design = gc.GearDesign(teeth=(20, 500), module="2 mm", face_width="20 mm")
    close, whole = plot.gear_pair(design, axes()).child_axes
    corners = [len(polygon) for polygon in polygons(whole)]
    assert corners[0] > 20 * 20 and corners[1] < 400
    assert overlap(*polygons(close)) < TOLERANCE
    assert np.hypot(*(polygons(whole)[1] - [0, 0.52]).T).max() == pytest.approx(0.5, rel=1e-12)


@pytest.mark.parametrize("name", ["12/40 shifted", "14/30 undercut", "62/62"])
def test_spur_teeth_are_those_of_the_potential_energy_method(name):
    """Fillets and flanks by the formulas of Ma et al. (2014), at the same points of the rack and of the involute."""
    given = {key: value for key, value in DESIGNS[name].items() if key != "backlash"}
    geometry = gc.GearDesign(**given).geometry
    section = TransverseSection(geometry, geometry.theoretical_backlash, 0.5)
    for wheel in (0, 1):
        profile = tooth_profile(geometry, wheel)
        points = section.outline(wheel, range(1)) - section.centres[wheel]
        axis = section.tooth_axis(wheel, section.contacts[0])
        along = points @ [math.cos(axis), math.sin(axis)]
        across = points @ [math.sin(axis), -math.cos(axis)]
        slopes = np.linspace(math.pi / 2, profile.rack.flank_normal(profile), FILLET_POINTS)
        touched = np.column_stack(profile.rack.fillet(slopes))  # by the tangents between the corners
        assert distances(touched, np.column_stack([across, along])).max() < TOLERANCE
        flank = slice(FILLET_POINTS, FILLET_POINTS + FLANK_POINTS)
        angle = np.arccos(np.minimum(profile.base_radius / np.hypot(along, across)[flank], 1.0))
        expected = np.column_stack(profile.flank(profile.slope(angle)))
        assert np.column_stack([across, along])[flank] == pytest.approx(expected, abs=1e-9)
