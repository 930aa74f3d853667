"""Curves of a gear design: mesh stiffness and transmission error, against closed forms and the arrays behind them."""

import numpy as np
import pytest
from matplotlib.patches import StepPatch

import gearchaos as gc
from gearchaos import plot
from gearchaos.errors import InputError
from tests.branches import axes
from tests.contracts.plot.figures import cut
from tests.pictures import legend_words

pytestmark = pytest.mark.slow

SPUR = {"teeth": (62, 62), "module": "2 mm", "face_width": "20 mm", "bore": "35 mm",
        "quality": {"standard": "ISO 1328-1:1995", "grade": 6}, "transmission_error": "from quality"}
HELICAL = {"teeth": (20, 40), "module": "3 mm", "face_width": "30 mm", "helix_angle": "15 deg", "bore": "20 mm"}


def steps(ax) -> list[tuple[np.ndarray, np.ndarray]]:
    """Values and edges of what is drawn as steps."""
    return [(p.get_data().values, p.get_data().edges) for p in ax.patches if isinstance(p, StepPatch)]


def test_two_levels_are_drawn_as_steps_with_the_levels_of_iso():
    design = gc.GearDesign(**SPUR)
    ax = plot.mesh_stiffness(design, axes(), compare=False)
    ((values, edges),) = steps(ax)
    tooth, width = design.tooth_stiffness, design.geometry.common_face_width
    assert values == pytest.approx(tooth.single_stiffness * width * 1e-6 * np.array([1.75, 1.0]), rel=1e-12)
    assert edges == pytest.approx([0, design.geometry.contact_ratio - 1, 1], rel=1e-12)
    (mean,) = {line.get_ydata()[0] for line in ax.lines}
    assert mean == pytest.approx(tooth.mesh_stiffness * width * 1e-6, rel=1e-12)
    assert values @ np.diff(edges) == pytest.approx(mean, rel=1e-12)
    assert legend_words(ax) == [f"ISO 6336-1, mean {mean:.4g} N/µm:\ntwo levels, exact"]


@pytest.mark.parametrize("method", ["ISO 6336-1", "potential energy"])
def test_accepted_methods_stand_side_by_side_with_their_means(method):
    ax = plot.mesh_stiffness(gc.GearDesign(**SPUR, stiffness=method), axes())
    texts = legend_words(ax)
    assert len(texts) == 2 and texts[0].startswith(method)
    means = {t.split(",")[0]: float(t.split("mean ")[1].split()[0]) for t in texts}
    assert sorted(line.get_ydata()[0] for line in ax.lines) == pytest.approx(sorted(means.values()), rel=1e-3)
    assert means["ISO 6336-1"] == pytest.approx(460.9, abs=0.1)
    energy = gc.GearDesign(**SPUR, stiffness="potential energy").mesh_stiffness
    assert means["potential energy"] == pytest.approx(1e-6 * energy.reference, rel=1e-3)
    (text,) = (t for t in texts if t.startswith("potential"))
    assert f"rms error {100 * energy.truncation:.2g} %" in text and f"{len(energy.waveform.levels)} levels" in text


def test_a_fourier_series_is_drawn_smooth_and_its_truncation_stated():
    design = gc.GearDesign(**HELICAL)
    ax = plot.mesh_stiffness(design, axes())
    curve = max(ax.lines, key=lambda line: len(line.get_xdata()))
    found = design.mesh_stiffness
    assert curve.get_ydata() == pytest.approx(1e-6 * found(curve.get_xdata()), rel=1e-12)
    assert steps(ax) == [] and len(legend_words(ax)) == 1, "the potential-energy method is for spur gears"
    assert f"rms error {100 * found.truncation:.2g} %" in legend_words(ax)[0]
    (second,) = ax.child_axes
    assert second.get_xlim() == pytest.approx((0, 360 / 20)) and ax.get_xlim() == (0, 1), "roll angle of wheel 1"
    exact = design.geometry.common_face_width * design.tooth_stiffness.mesh_stiffness * 1e-6
    assert np.trapezoid(curve.get_ydata(), curve.get_xdata()) == pytest.approx(exact, rel=1e-12)


def test_a_stiffness_without_a_bore_is_compared_with_none():
    given = {name: value for name, value in SPUR.items() if name != "bore"}
    assert len(legend_words(plot.mesh_stiffness(gc.GearDesign(**given), axes()))) == 1
    with pytest.raises(InputError) as error:
        plot.mesh_stiffness(gc.GearDesign(**given, stiffness="potential energy"), axes())
    assert error.value.field == "bore"


def test_the_error_is_the_sum_of_its_harmonics():
    design = gc.GearDesign(**SPUR)
    curve, bars = plot.transmission_error(design, axes()).child_axes
    (line,) = (line for line in curve.lines if len(line.get_xdata()) > 2)
    error = design.error_harmonics
    expected = sum(e * np.cos(2 * np.pi * j * line.get_xdata() - phase)
                   for j, (e, phase) in enumerate(zip(error.amplitudes, error.phases, strict=True), 1))
    assert line.get_ydata() == pytest.approx(1e6 * expected, abs=1e-9)
    heights = [bar.get_height() for bar in bars.patches]
    assert heights == pytest.approx([1e6 * e for e in error.amplitudes], rel=1e-12)
    assert [bar.get_x() + bar.get_width() / 2 for bar in bars.patches] == pytest.approx([1, 2, 3])
    lag = line.get_xdata()[np.argmax(line.get_ydata())]
    assert lag == pytest.approx((design.geometry.contact_ratio - 1) / 2, abs=0.01)


def test_exact_gears_have_no_error():
    ax = plot.transmission_error(gc.GearDesign(**HELICAL), axes())
    curve, bars = ax.child_axes
    assert all(not np.any(line.get_ydata()) for line in curve.lines) and not bars.patches
    assert ax.get_title(loc="left") == "none: the gears are taken to be exact"
    assert [text.get_text() for text in bars.texts] == ["no harmonics"] and not bars.get_yticks().size


def test_what_the_harmonics_of_a_table_leave_out_is_stated(tmp_path):
    table = tmp_path / "error.csv"
    angle = np.linspace(0, 360 / 62, 257)
    values = 3 * np.abs(np.linspace(-1, 1, 257))  # a triangle has harmonics of any order
    table.write_text("roll angle [deg],error [um]\n" + "\n".join(map("{},{}".format, angle, values)) + "\n")
    design = gc.GearDesign(**{**SPUR, "transmission_error": {"table": str(table)}})
    title = plot.transmission_error(design, axes()).get_title(loc="left")
    rest = design.error_harmonics
    assert f"{1e6 * rest.residual_rms:.3g} µm rms" in title.replace("\n", " ")


PICTURES = {"mesh_stiffness": plot.mesh_stiffness, "transmission_error": plot.transmission_error}


@pytest.mark.parametrize("size", [(3.4, 2.8), *(
    pytest.param(size, marks=pytest.mark.exhaustive) for size in ((3.9, 4.8), (6.4, 4.8), (13.6, 6)))], ids=str)
@pytest.mark.parametrize("name", PICTURES)
@pytest.mark.parametrize("design", [SPUR, HELICAL], ids=["spur", "helical"])
def test_no_text_is_cut(name, design, size):
    assert cut(PICTURES[name](gc.GearDesign(**design), axes(*size)).figure) == []


@pytest.mark.parametrize("name", PICTURES)
def test_only_designs_are_drawn(name):
    with pytest.raises(InputError, match="design must be a GearDesign"):
        PICTURES[name](gc.MeshModel(), axes())
