"""Studies return labelled Datasets that say what they are, survive saving, and refuse bad axes before any work."""

import _thread
import json
import signal
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import xarray as xr

import gearchaos as gc
from gearchaos.dynamics import Classification, Label
from gearchaos.errors import InputError
from gearchaos.execute import tiles
from gearchaos.store.lock import Shard
from gearchaos.studies import motions
from gearchaos.studyfile import load_study
from tests import ONE_SPRING

pytestmark = pytest.mark.slow

FIGURE_2 = gc.MeshModel.of(q0=0.1)
FIVE = gc.MeshModel.of(kind="single", omega=2.3, eps1=0.05)
"""Motions of it have the periods 1, 3, 4, 4 and 5."""

MAP = "omega=0.4:2.8:13", "eps1=0:0.3:8"


@pytest.fixture(scope="module")
def small_map():
    return gc.zones(FIGURE_2, *MAP)


def test_datasets_name_units_and_provenance_and_survive_saving(small_map, tmp_path):
    assert small_map.omega.attrs == {"long_name": "mesh frequency", "units": "omega0"}
    assert small_map.label.attrs["flag_meanings"] == "periodic quasi-periodic chaotic undecided diverged"
    assert json.loads(small_map.attrs["model"])["q1"] == 0.1
    assert small_map.attrs["gearchaos_version"] == gc.__version__
    gc.save(small_map, tmp_path / "map.nc")
    gc.save(gc.load(tmp_path / "map.nc"), tmp_path / "map.nc")
    assert gc.load(tmp_path / "map.nc").identical(small_map)
    assert [p.name for p in tmp_path.iterdir()] == ["map.nc"]
    with pytest.raises(InputError, match="must lie in an existing folder"):
        gc.save(small_map, tmp_path / "missing" / "map.nc")


def test_saving_adds_checksums_and_leaves_the_rest_of_the_encoding(small_map, tmp_path):
    packed = small_map.copy()
    packed["v_rms"].encoding = {"zlib": True, "complevel": 4}
    gc.save(packed, tmp_path / "map.nc")
    with xr.open_dataset(tmp_path / "map.nc", engine="h5netcdf") as saved:
        assert all(v.encoding["fletcher32"] for v in saved.variables.values() if v.dims)
        assert saved["v_rms"].encoding["zlib"] and not saved["label"].encoding["zlib"]
    assert packed["v_rms"].encoding == {"zlib": True, "complevel": 4} and not packed["label"].encoding


def test_loading_says_what_is_wrong_with_the_path(small_map, tmp_path):
    gc.save(small_map, tmp_path / "map.nc")
    whole = (tmp_path / "map.nc").read_bytes()
    (tmp_path / "cut.nc").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "study.nc").write_text("[study]")
    at = whole.index(small_map.lyapunov.values.tobytes()[:64])
    (tmp_path / "flipped.nc").write_bytes(whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :])
    damaged = dict.fromkeys(["cut.nc", "study.nc", "flipped.nc"], "whole and readable.*save it again")
    for name, words in {"missing.nc": "There is no such file", **damaged}.items():
        with pytest.raises(InputError, match=f"path must be a NetCDF file.*{words}"):
            gc.load(tmp_path / name)
    with pytest.raises(InputError, match="store must be a folder that gearchaos run made"):
        gc.load(tmp_path)


def test_simulate_samples_and_sections_belong_together():
    data = gc.simulate(gc.MeshModel.of(kind="full", omega=1.05, eps1=0.1), 3, transient=2, samples=40)
    assert data.sizes == {"period": 3, "tau": 120}
    for name in ("x1", "x2_dot", "y1", "y2_dot", "z", "z_dot"):
        np.testing.assert_allclose(data[name].values[[40, 80]], data[f"section_{name}"].values[:2], atol=1e-12)
    np.testing.assert_allclose(data.tau[40], data.tau_section[0])
    z_dot = np.gradient(data.z.values, data.tau.values)
    np.testing.assert_allclose(z_dot[1:-1], data.z_dot.values[1:-1], atol=0.02)
    error = data.x1 - data.x2 + data.y1 - data.y2 - data.z
    np.testing.assert_allclose(error, 0.1 * np.cos(1.05 * data.tau), atol=1e-12)


def test_a_simulation_that_runs_away_says_so_and_ends_in_nan():
    data = gc.simulate(gc.MeshModel.of(kind="single", omega=2.0, z=30.0), 600, samples=4)
    z = data.section_z.values
    assert data.attrs["status"] == "diverged" and np.isfinite(z[:50]).all() and np.isnan(z[-1])
    assert np.nanmax(np.abs(z)) < 1e8 and gc.simulate(FIGURE_2, 3).attrs["status"] == "ok"


def test_bifurcation_columns_show_as_many_points_as_the_period():
    data = gc.bifurcation(FIGURE_2.with_values({"omega": 1.0}), gc.Axis("eps1", 0.2, 0.209, 10), points=64)
    for i in range(data.sizes["eps1"]):
        column, period = data.section_x1.values[i], int(data.period[i])
        if period:
            assert len(np.unique(column.round(7))) == period


def test_attractors_do_not_depend_on_threads_or_tiles(monkeypatch):
    data = gc.attractors(FIVE, 512)
    assert data.attractor_period.values.tolist() == [1, 3, 4, 4, 5]
    xr.testing.assert_identical(data, gc.attractors(FIVE, 512, threads=1))
    monkeypatch.setattr(tiles, "_MIN_PER_THREAD", 5)
    monkeypatch.setattr(tiles, "_LEAST_TILE", 5)
    monkeypatch.setattr(tiles, "_FINAL_DIVISOR", 64)
    xr.testing.assert_identical(data, gc.attractors(FIVE, 512))


def test_kicks_out_of_and_into_chaos():
    """Beside chaos kicked motions may all settle on orbits: none is then left to compare with the chaotic attractor."""
    quick = gc.Classification(exponent_run=100, doublings=0, longest_transient=1280)
    data = gc.attractors(gc.MeshModel.of(omega=1.6, eps1=0.12), 24, kicks=4, settings=quick)
    found = set(motions(data.attractor_label, data.attractor_period))
    assert {"2T", "chaotic"} <= found <= {"2T", "3T", "chaotic"}  # few of the starts lead to the 3T
    known = data.attractor_kick[np.isfinite(data.attractor_kick)]
    assert len(known) >= 2 and np.all((known > 0) & (known <= 4))


def test_sweeps_lead_to_attractors_and_kicks_lead_out_of_them():
    data = gc.attractors(FIVE, 64, sweep=gc.Axis("omega", 2.0, 2.6, 30), kicks=16)
    assert (int(data.attractor_up), int(data.attractor_down)) == (0, 0)
    plane = gc.basins(FIVE, gc.Axis("z", -3.0, 3.0, 150), gc.Axis("z_dot", -2.0, 2.0, 150))
    assert plane.attractor_period.values.tolist() == [1, 3, 4, 4, 5] and float(plane.attractor_fraction.sum()) == 1
    np.testing.assert_allclose(np.sort(data.attractor_kick), np.sort(plane.attractor_kick), atol=0.04)
    np.testing.assert_allclose(np.linalg.norm(data.attractor_kick_change, axis=1), data.attractor_kick, rtol=1e-12)
    for number, (z, z_dot) in enumerate((data.attractor_kick_point + data.attractor_kick_change).values):
        end = gc.regime(FIVE.with_values({"z": z, "z_dot": z_dot})).section
        gaps = [np.subtract.outer(end[n], data[f"attractor_section_{n}"].values[number]) for n in ("z", "z_dot")]
        assert np.nanmin(np.hypot(*gaps)) > 1e-3


def test_kicks_work_in_all_coordinates():
    model, hasty = gc.MeshModel.of(kind="full", omega=1.9, eps1=0.03), Classification(longest_transient=0)
    data = gc.attractors(model, 16, kicks=4, settings=hasty)
    assert data.attractor_kick_change.shape == (data.sizes["number"], 4)
    assert list(data.coordinate.values) == ["z", "z_dot", "y", "y_dot"]


def test_the_same_kick_in_any_coordinates_of_the_plane():
    """x1 of the torsional model moves z alone."""
    axes = [gc.Axis("x1", -1.0, 2.0, 60), gc.Axis("x1_dot", -1.0, 1.0, 60)]
    model = gc.MeshModel.of(omega=2.3, eps1=0.05)
    straight, turned = gc.basins(model, *axes), gc.basins(model, *axes[::-1])
    assert np.all(np.isfinite(straight.attractor_kick))
    np.testing.assert_allclose(straight.attractor_kick, turned.attractor_kick, rtol=1e-12)
    other = gc.basins(model.with_values({"x2": 0.5}), gc.Axis("x1", -0.5, 2.5, 60), axes[1])
    np.testing.assert_allclose(straight.attractor_kick, other.attractor_kick, rtol=1e-9)


def test_a_map_with_many_starts_counts_the_motions_of_each_cell():
    model = gc.MeshModel.of(kind="single")
    axes = gc.Axis("omega", 0.8, 2.3, 2), gc.Axis("eps1", 0.05, 0.1, 2)
    data, plain = gc.zones(model, *axes, starts=96), gc.zones(model, *axes)
    assert int(data.attractors.sel(omega=2.3, eps1=0.05)) == 5
    assert int(data.attractors.sel(omega=0.8, eps1=0.1)) == 2
    assert np.all(data.v_rms_least <= plain.v_rms) and np.all(plain.v_rms <= data.v_rms_most)
    found = gc.attractors(model.with_values({"omega": 2.3, "eps1": 0.05}), 64)
    for end, value in (("least", found.attractor_v_rms.min()), ("most", found.attractor_v_rms.max())):
        assert float(data[f"v_rms_{end}"].sel(omega=2.3, eps1=0.05)) == pytest.approx(float(value))
    assert int(data.contact_worst.sel(omega=2.3, eps1=0.05)) == 2
    assert np.all(data.v_rms_least <= data.v_rms_up) and np.all(data.v_rms_down <= data.v_rms_most)
    for name in plain.data_vars:
        xr.testing.assert_equal(data[name], plain[name])


def test_a_map_of_gears_with_many_starts_looks_at_load_changes():
    loaded = load_study(ONE_SPRING).model
    axes = gc.Axis("speed", 700.0, 1500.0, 5), gc.Axis("torque", 60.0, 200.0, 3)
    study = gc.Zones(loaded, *axes, starts=6)
    whole = study.run()
    assert whole.share_of_load_changes.values.min() + whole.share_of_load_changes.values.max() > 0
    row = study.compute(np.arange(5, 10))  # draws of a row depend on no other row
    for name in ("to_avoid", "share_of_load_changes", "attractors", "v_rms_most"):
        np.testing.assert_array_equal(row[name], whole[name].values[1])
    here = gc.speeds_to_avoid(loaded.gears, "700:1500:5", 130.0, starts=16, spacing=0.5, knocks=False)
    for speed in axes[0].values:
        cell = int(whole.to_avoid.sel(speed=speed, torque=130.0))
        assert (cell > 0) == any(a.start <= speed <= a.stop for a in here.windows)
    none, wide = gc.Zones(loaded, *axes, starts=6, load_change=-0.9), gc.zones(loaded, *axes, starts=6, wide=True)
    assert none.run().share_of_load_changes.sum() < whole.share_of_load_changes.sum() and "to_avoid" not in wide
    assert np.all(wide.v_rms_most >= wide.v_rms_least)


@pytest.mark.parametrize("given", [{"wide": True}, {"load_change": 0.0}])
def test_only_gears_have_a_load_that_changes(given):
    with pytest.raises(InputError, match=f"{next(iter(given))} needs gears"):
        gc.Zones(FIGURE_2, *MAP, starts=4, **given)


@pytest.mark.parametrize(("given", "field"), [
    ({"wide": True}, "starts"), ({"load_change": 0.0}, "starts"),
    ({"wide": True, "load_change": 0.0, "starts": 4}, "load_change")])
def test_states_after_a_load_change_that_no_start_has_are_refused(given, field):
    gears = load_study(ONE_SPRING).model
    with pytest.raises(InputError) as error:
        gc.Zones(gears, "speed=700:1500:3", "torque=100:130:2", **given)
    assert error.value.field == field


def test_an_interrupt_leaves_nothing_but_the_tiles_under_way(monkeypatch):
    """Also one that comes early, while tiles are still being handed out: slowly, as where a compiler holds the GIL."""
    begun, submit = [], ThreadPoolExecutor.submit

    def slowly(*arguments, **options):
        time.sleep(0.005)
        return submit(*arguments, **options)

    def work(tile):
        begun.append(tile)
        time.sleep(0.05)

    monkeypatch.setattr(ThreadPoolExecutor, "submit", slowly)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # a background job inherits that it is ignored
    try:
        threading.Timer(0.5, _thread.interrupt_main).start()
        with pytest.raises(KeyboardInterrupt):
            list(tiles.run(work, tiles.split(400, 1), threads=2))
    finally:
        signal.signal(signal.SIGINT, before)
    assert len(begun) < 40


def test_maps_show_hysteresis_where_diagrams_do():
    axis = gc.Axis("omega", 0.6, 0.9, 31)
    row = gc.zones(FIGURE_2, axis, gc.Axis("eps1", 0.02, 0.03, 2), starts=2).sel(eps1=0.02)
    model = FIGURE_2.with_values({"eps1": 0.02})
    diagrams = {mode: gc.bifurcation(model, axis, points=0, mode=mode) for mode in ("up", "down")}
    for mode, diagram in diagrams.items():
        assert not any("section" in name for name in diagram.data_vars)
        regular = diagram.label == Label.PERIODIC
        np.testing.assert_allclose(row[f"v_rms_{mode}"][regular], diagram.v_rms[regular], rtol=1e-6)
    assert 0 < int((np.abs(diagrams["up"].v_rms - diagrams["down"].v_rms) > 0.02).sum()) < 31
    assert 0 < int(row.hysteresis.sum()) < 31 and np.all(row.attractors.where(row.hysteresis == 1) != 1)


def test_a_torus_is_one_attractor_and_so_is_chaos():
    torus = gc.attractors(gc.MeshModel.of(kind="full", omega=1.05, eps1=0.04), 40)
    assert torus.attractor_label.values.tolist() == [Label.QUASI_PERIODIC]
    beside_orbits = gc.attractors(gc.MeshModel.of(omega=1.0, eps1=0.1, q0=0.02), 256)
    assert beside_orbits.attractor_period.values.tolist() == [3, 5, 0]
    assert beside_orbits.attractor_label.values[-1] == Label.CHAOTIC


def test_basins_of_any_plane_of_the_full_model():
    data = gc.basins(gc.MeshModel.of(kind="full", omega=0.9, eps1=0.05), "y1=-2:2:12", "x1_dot=-1:1:10")
    assert data.attractor.shape == (10, 12) and np.isnan(data.attractor_kick).all()


def test_a_map_has_one_set_of_coordinates_whatever_coincides_in_part_of_it():
    """β1 = β2 at one end, so that a tile there alone could do with fewer coordinates than the others."""
    data = gc.bifurcation(gc.MeshModel.of(omega=1.2), "beta1=0.005:0.01:65", points=0)
    assert set(data.label.values) == {Label.PERIODIC}
    model, hasty = gc.MeshModel.of(omega=1.0, eps1=0.22), Classification(longest_transient=3000)
    assert gc.bifurcation(model, "beta1=0.01:0.3:2", points=0, settings=hasty).label.values[0] == Label.CHAOTIC
    assert gc.zones(gc.MeshModel.of(), "eps1=0:0.05:10", "beta1=0.01:0.02:2", starts=2).label.shape == (2, 10)


def test_an_attractor_is_described_as_it_was_found():
    data = gc.attractors(gc.MeshModel.of(omega=1.0, eps1=0.206), 16, settings=Classification(longest_transient=0))
    chaos = data.attractor_label == Label.CHAOTIC
    assert np.all(data.attractor_trace_error < 1e-9) and np.all(data.attractor_lyapunov_lo[chaos] > 0)
    assert np.all(data.attractor_periods_spent[chaos] >= 1280) and data.attractor_multiplier[chaos].isnull().all()


BAD = [
    (lambda: gc.Axis("omega", 1.0, 0.5, 10), "must run from a smaller to a larger value"),
    (lambda: gc.Axis("omega", 1.0, 2.0, 0), "count must be a whole number from 1"),
    (lambda: Shard(0, 3), "i from 1 to n"), (lambda: Shard(4, 3), "i from 1 to n"),
    (lambda: gc.Axis("omega", 1.0, float("nan"), 3), "must be a finite number"),
    (lambda: gc.zones(FIGURE_2, gc.Axis("omega", -1.0, 1.0, 3), gc.Axis("eps1", 0, 1, 2)), "omega must be greater"),
    (lambda: gc.zones(FIGURE_2, gc.Axis("omega", 1.0, 2.0, 3), gc.Axis("omega", 1, 2, 2)), "two different"),
    (lambda: gc.zones(FIGURE_2, gc.Axis("omgea", 1.0, 2.0, 3), gc.Axis("eps1", 0, 1, 2)), "Did you mean 'omega'"),
    (lambda: gc.zones(FIGURE_2, gc.Axis("q1", 1.0, 2.0, 3), gc.Axis("q0", 0, 1, 2)), "both set q1"),
    (lambda: gc.zones(FIGURE_2, gc.Axis("q1", 1, 2, 3), gc.Axis("eps1", 0, 1, 2), threads=0), "threads must be"),
    (lambda: gc.zones(FIGURE_2, *MAP, starts=2, refine=2), "refine must"),
    (lambda: gc.zones(FIGURE_2, *MAP, refine=256), "at most 128"),
    (lambda: gc.attractors(FIGURE_2, 4, sweep=gc.Axis("omega", 0.5, 3, 1)), "whole number of at least 2"),
    (lambda: gc.basins(FIGURE_2, gc.Axis("omega", 1.0, 2.0, 3), gc.Axis("x1", 0, 1, 2)), "initial value"),
    (lambda: gc.simulate(FIGURE_2, 0), "periods must be a whole number of at least 1; got 0"),
    (lambda: gc.simulate(FIGURE_2, 5, transient=-1), "transient must be"),
    (lambda: gc.simulate(FIGURE_2, 5, samples=0), "samples must be"),
    (lambda: gc.zones(FIGURE_2, *MAP, starts=0), "starts must be a"),
    (lambda: gc.zones(FIGURE_2, gc.Axis("omega", 1, 2, 3), gc.Axis("q0", 0, 1, 2), starts=10**10), "times starts must"),
    (lambda: gc.zones(FIGURE_2, gc.Axis("x1", 1.0, 2.0, 3), gc.Axis("eps1", 0, 1, 2), starts=4), "starts must be 1"),
    (lambda: gc.attractors(FIGURE_2, 0), "starts must be a whole number of at least 1; got 0"),
    (lambda: gc.attractors(FIGURE_2, 4, kicks=-1), "kicks must be"),
    (lambda: gc.attractors(FIGURE_2, 4, sweep=gc.Axis("omega", 0.5, 1.0, 4)), "from below to above the model's value"),
    (lambda: gc.attractors(FIGURE_2, 4, sweep=gc.Axis("omega", 1.0, 1.5, 4)), "from below to above"),
    (lambda: gc.attractors(FIGURE_2.with_values({"q2": 0.2}), 4, sweep=gc.Axis("q0", 0, 1, 4)), "one value for both"),
    (lambda: gc.attractors(FIGURE_2, 4, sweep=gc.Axis("x1", 0, 3, 4)), "must be a parameter"),
    (lambda: gc.attractors(FIGURE_2, 10**13), "starts must be at most"),
    (lambda: gc.attractors(FIGURE_2, 4, box={"x1": (1.0, 1.0)}), "box x1 must be two finite numbers"),
    (lambda: gc.attractors(FIGURE_2, 4, box={"x1": (0.0, float("inf"))}), "box x1 must be a finite number"),
    (lambda: gc.attractors(FIGURE_2, 4, box={"y1": (0.0, 1.0)}), "y1"),
    (lambda: gc.zones(FIGURE_2, gc.Axis("omega", 1.0, 2.0, 10**6), gc.Axis("eps1", 0, 1, 10**6)), "cells must be at"),
    (lambda: gc.bifurcation(FIGURE_2, gc.Axis("q0", 0, 1, 2), mode="sideways"), "must be one of down, fixed, up"),
    (lambda: gc.bifurcation(gc.MeshModel.of(eps1=0.1), gc.Axis("x1", 0, 1, 3), mode="up"), "mode must be fixed"),
]


@pytest.mark.parametrize(("call", "message"), BAD, ids=[m for _, m in BAD])
def test_bad_input_is_named(call, message):
    with pytest.raises(InputError, match=message):
        call()
