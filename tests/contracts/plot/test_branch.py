"""Pictures of branches: parts by stability, events, jumps, gaps, units."""

import numpy as np
import pytest

import gearchaos as gc
from gearchaos import plot
from gearchaos.errors import InputError
from tests.branches import CHANGES, PAIR, SINGLE, axes, cascade, over_speed, resonance
from tests.pictures import legend_words


def lines(ax, dashed: bool) -> list:
    return [line for line in ax.lines if line.get_linestyle() == ("--" if dashed else "-") and len(line.get_xdata()) > 1
            and line.get_marker() == "None"]


def arrows_of(ax) -> list:
    return [t for t in ax.texts if t.arrow_patch is not None]


def events(ds, *kinds) -> np.ndarray:
    return ds["event_value"].values[np.isin(ds["event_kind"].values, kinds)]


def test_the_response_curve_shows_stability_events_and_jumps():
    ds = resonance()
    ax, other = plot.response_curve(ds, ax=axes()), plot.branch(ds, ax=axes())
    assert legend_words(ax) == ["stable", "unstable", "fold", "flip", "graze", "jump"]
    ends = np.append(events(ds, *CHANGES), (0.3, 2.5))
    for line in lines(ax, dashed=False):
        assert all(np.abs(ends - x).min() < 1e-12 for x in line.get_xdata()[[0, -1]])
    assert lines(ax, dashed=True)
    for dashed in (False, True):  # the other picture changes at the same events
        assert [x.get_xdata().tolist() for x in lines(ax, dashed)] == [
            x.get_xdata().tolist() for x in lines(other, dashed)]
    for arrow in arrows_of(ax):
        (x, end), (x0, start) = arrow.xy, arrow.xyann
        assert x == x0 and np.abs(events(ds, "fold") - x).min() < 1e-12 and start != end
    last = max(arrows_of(ax), key=lambda a: a.xy[0])  # the jump of a run-up at the main resonance, upwards
    assert last.xy[1] > last.xyann[1]


def test_selected_points_are_drawn_with_gaps():
    ds, whole = resonance(), plot.response_curve(resonance(), ax=axes())
    for chosen, dashed in ((ds["unstable"].values > 0, True), (ds["unstable"].values == 0, False)):
        part = gc.physical(ds, PAIR).isel(point=chosen) if dashed else ds.isel(point=chosen)
        unit = PAIR.scales.length * 1e6 if dashed else 1.0
        ax = plot.response_curve(part, ax=axes())
        own, other = lines(ax, dashed), lines(ax, not dashed)
        assert all(np.isin(line.get_xdata(), part["event_value"]).all() for line in other), "events beside each other"
        curves = [np.column_stack([np.asarray(x.get_xdata()), x.get_ydata()]) for x in lines(whole, dashed)]
        assert len(own) == len(curves)
        for line, curve in zip(own, curves, strict=True):
            assert line.get_ydata().tolist() == pytest.approx((curve[:, 1] * unit).tolist(), rel=1e-9)
    drawn = plot.branch(ds.isel(point=ds["unstable"].values == 0), ax=axes())
    assert len(lines(drawn, dashed=False)) == len(lines(whole, dashed=False))
    mixed = ds.isel(point=np.random.default_rng(0).permutation(ds.sizes["point"]))
    for a, b in zip(plot.response_curve(mixed, ax=axes()).lines, whole.lines, strict=True):
        np.testing.assert_array_equal(a.get_xydata(), b.get_xydata())


@pytest.mark.slow
def test_a_branch_of_doubled_motions_begins_or_ends_at_a_flip():
    ax = plot.branch(cascade(), ax=axes())
    ends = {x for line in lines(ax, dashed=False) for x in line.get_xdata()[[0, -1]].tolist()}
    assert ends & set(events(cascade(), "flip").tolist())
    assert ax.get_legend() is not None and ax.get_ylabel()


def test_jumps_are_variables():
    ds = resonance()
    stable, x = ds["unstable"].values == 0, ds["omega"].values
    assert ds["jump_value"].dims == ("jump",)
    assert ds["jump_direction"].values.tolist() == [1, -1] * 4
    for i in range(ds.sizes["jump"]):
        value, event = float(ds["jump_value"][i]), int(ds["jump_event"][i])
        assert ds["event_kind"].values[event] == "fold" and float(ds["event_value"][event]) == value
        direction, after = int(ds["jump_direction"][i]), int(ds["jump_point"][i])
        state = {n: float(ds[f"event_section_{n}"][event]) for n in ("z", "z_dot")}
        reached = gc.regime(SINGLE.with_values({"omega": value + direction * 2.2e-4, **state}))
        assert (ds["jump_label"].values[i], ds["jump_period"].values[i]) == (1, reached.period)
        points = ds["section_z"].values[after : after + 2, 0]
        assert min(points) - 1e-3 <= reached.section["z"][0] <= max(points) + 1e-3
        assert stable[after] or stable[after + 1]
        assert min(x[after : after + 2]) <= value + direction * 2.2e-4 <= max(x[after : after + 2])
    assert len(arrows_of(plot.response_curve(ds, ax=axes()))) == (ds["jump_point"] >= 0).sum()
    scaled = gc.physical(ds, PAIR)
    np.testing.assert_allclose(scaled["jump_value"], scaled["event_value"].values[ds["jump_event"].values], rtol=1e-15)
    old = ds.drop_dims("jump").drop_vars("position")
    assert len(plot.response_curve(old, ax=axes()).lines) == len(plot.response_curve(ds, ax=axes()).lines)


def test_pictures_of_a_branch_are_in_its_units():
    ds, scaled = over_speed(), gc.physical(over_speed())
    plain, physical = plot.response_curve(ds, ax=axes()), plot.response_curve(scaled, ax=axes())
    assert physical.get_ylabel() == "peak to peak of z [µm]" and physical.get_xlabel() == "speed [rpm]"
    assert plain.get_ylabel() == "peak to peak of z [–]" and plain.get_xlabel() == "speed [rpm]"
    assert plot.branch(ds, ax=axes()).get_ylabel().endswith("[–]")
    assert plot.response_curve(resonance(), ax=axes()).get_ylabel() == "peak to peak of z"
    for a, b in zip(plain.lines, physical.lines, strict=True):
        np.testing.assert_allclose(b.get_ydata(), np.asarray(a.get_ydata()) * PAIR.scales.length * 1e6, rtol=1e-9)


def test_the_section_lies_over_a_diagram():
    diagram = gc.bifurcation(SINGLE, "omega=0.8:1.4:8", points=4)
    ax = plot.bifurcation(diagram, ax=axes())
    limits = ax.get_xlim(), ax.get_ylim()
    plot.branch(resonance(), ax=ax)
    assert (ax.get_xlim(), ax.get_ylim()) == limits and len(ax.lines) > 1


def test_a_branch_without_events_has_a_picture():
    ds = gc.branch(SINGLE, "omega=0.99:1.01")
    assert legend_words(plot.response_curve(ds, "v_rms", axes())) == ["stable"]


def test_what_is_no_branch_is_refused():
    with pytest.raises(InputError, match="must be a result of branch"):
        plot.response_curve(gc.bifurcation(SINGLE, "omega=0.8:1.4:3", points=4))
    with pytest.raises(InputError, match="must be one of"):
        plot.response_curve(resonance(), "label")
    with pytest.raises(InputError, match="response_curve or branch"):
        plot.lyapunov(resonance())
