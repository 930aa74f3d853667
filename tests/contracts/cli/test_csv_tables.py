"""Results as CSV: a row for each cell, column, point or event, units in titles, a file for each set of dimensions."""

import csv
import errno
import math
import re
from pathlib import Path

import numpy as np
import pytest

import gearchaos as gc
from gearchaos import csv_tables
from gearchaos.csv_tables import save_csv
from tests import EXAMPLES
from tests.commands import ask, refused
from tests.contracts.model.test_damping_law import PAIR

MODEL = gc.MeshModel.of(q0=0.1)
SPUR = EXAMPLES / "spur_50_50.toml"
STUDY = '[model]\nomega = 1.0\n[study]\nkind = "zones"\nx = "omega=0.9:1.1:5"\ny = "eps1=0:0.3:7"\n'


def read(path):
    """The columns of a table by title, read by Python's csv module; all text is ASCII."""
    with open(path, newline="", encoding="ascii") as file:
        title, *rows = csv.reader(file)
    return dict(zip(title, map(list, zip(*rows, strict=True)), strict=True))


def numbers(texts):
    return np.array([float(t) if t else math.nan for t in texts])


def test_a_row_for_each_cell_with_units(tmp_path):
    zones = gc.zones(MODEL, "omega=0.9:1.1:5", "eps1=0:0.3:7")
    assert gc.save(zones, tmp_path / "z.csv") == [tmp_path / "z.csv"]
    table = read(tmp_path / "z.csv")
    cells = [(e, o) for e in zones.eps1.values for o in zones.omega.values]
    np.testing.assert_array_equal(numbers(table["eps1 [1]"]), [e for e, _ in cells])
    np.testing.assert_array_equal(numbers(table["omega [omega0]"]), [o for _, o in cells])
    for title in ("v_rms [delta*omega0]", "z_rms [delta]", "period [T]", "rotation [1/T]", "dynamic_factor [1]"):
        name = title.partition(" ")[0]
        np.testing.assert_array_equal(numbers(table[title]).astype(zones[name].dtype), zones[name].values.ravel())
    motions = gc.studies.motions(zones.label, zones.period)
    words = [f"{p}T" if kind == "periodic" else kind for kind, p in
             zip(table["label"], table["period [T]"], strict=True)]
    assert words == motions and len(set(motions)) > 2
    states = ["permanent", "one-sided", "two-sided", "none"]
    assert table["contact"] == [states[code] for code in zones.contact.values.ravel()]
    assert len(set(table["contact"])) > 1


def test_given_units_and_those_of_si_beside_each_other(tmp_path):
    found = gc.operating_map(PAIR, "600 rpm:9000 rpm:3", "60 N m:180 N m:2")
    gc.save(found, tmp_path / "m.csv")
    table = read(tmp_path / "m.csv")
    speed, torque = ([float(t) for t in table[title]] for title in ("speed [rpm]", "torque [N*m]"))
    assert speed == [600, 4800, 9000] * 2 and torque == [60] * 3 + [180] * 3
    for given, si, factor in (("speed [rpm]", "speed [rad/s]", math.pi / 30), ("z_rms [um]", "z_rms [m]", 1e-6),
                              ("v_rms [mm/s]", "v_rms [m/s]", 1e-3)):
        np.testing.assert_allclose(numbers(table[si]), factor * numbers(table[given]), rtol=3e-7)
    np.testing.assert_allclose(numbers(table["mesh_frequency [Hz]"]), 25 * np.array(speed) / 60, rtol=1e-14)
    assert [title for title in table if title.startswith("torque")] == ["torque [N*m]"]


def test_other_dimensions_have_files_of_their_own(tmp_path):
    found = gc.bifurcation(MODEL, "eps1=0.1:0.2:4", points=3)
    main, points = gc.save(found, tmp_path / "b.csv")
    assert (main.name, points.name) == ("b.csv", "b_eps1_point.csv")
    assert len(read(main)["eps1 [1]"]) == 4
    table = read(points)
    assert table["point"] == ["0", "1", "2"] * 4
    np.testing.assert_array_equal(numbers(table["section_z [delta]"]), found.section_z.values.ravel())
    basins = gc.basins(gc.MeshModel.of(kind="single", q0=0.1, omega=0.8, eps1=0.1), "z=-3:3:6", "z_dot=-2:2:6")
    files = {path.name: read(path) for path in gc.save(basins, tmp_path / "c.csv")}
    assert list(files) == ["c.csv", "c_number.csv", "c_number_point.csv", "c_values.csv"]
    assert numbers(files["c_values.csv"]["basin_entropy [nat]"]) == [basins.basin_entropy.item()]
    assert {*files["c.csv"]["attractor [1]"]} <= {"-1", *files["c_number.csv"]["number"]}


def test_where_one_table_cannot_be_written_none_is(tmp_path, monkeypatch):
    found = gc.bifurcation(MODEL, "eps1=0.1:0.2:4", points=3)
    (tmp_path / "b.csv").write_text("kept")
    lines = csv_tables._lines

    def full(dataset, dims, *more):
        yield from lines(dataset, dims, *more)
        if "point" in dims:
            raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(csv_tables, "_lines", full)
    with pytest.raises(OSError, match=r"No space left on device: '.*b\.csv'"):
        gc.save(found, tmp_path / "b.csv")
    assert [p.name for p in tmp_path.iterdir()] == ["b.csv"] and (tmp_path / "b.csv").read_text() == "kept"


def test_parts_make_the_same_table(tmp_path):
    zones = gc.zones(MODEL, "omega=0.9:1.1:3", "eps1=0:0.3:7").drop_vars("eps1")  # a dimension without values: numbers
    for step in (0, 1, 2, 7, 9):
        save_csv(zones, tmp_path / f"{step}.csv", step=step)
    texts = {(tmp_path / f"{step}.csv").read_text() for step in (0, 1, 2, 7, 9)}
    assert len(texts) == 1 and read(tmp_path / "1.csv")["eps1"] == [str(i) for i in range(7) for _ in range(3)]


def test_texts_empty_tables_and_cells_without_value(tmp_path):
    branch = gc.branch(gc.MeshModel.of(q0=0.1, eps1=0.015), "eps1=0.01:0.02")
    gc.save(branch, tmp_path / "b.csv")
    assert branch.sizes["event"] == 0
    assert (tmp_path / "b_event.csv").read_text().splitlines()[0].startswith("event,event_period [T],")
    assert len((tmp_path / "b_event.csv").read_text().splitlines()) == 1
    assert read(tmp_path / "b.csv")["contact_sequence"] == branch.contact_sequence.values.tolist()
    holes = gc.zones(MODEL, "omega=0.9:1.1:2", "eps1=0:0.3:2")
    holes["v_rms"][0, 0], holes["label"][0, 0] = math.nan, 0
    gc.save(holes, tmp_path / "h.csv")
    table = read(tmp_path / "h.csv")
    assert (table["v_rms [delta*omega0]"][0], table["label"][0]) == ("", "")
    assert "nan" not in str(table.values()).lower()


@pytest.mark.parametrize("arguments", [
    ("simulate", "--periods", 2), ("attractors", "--starts", 8), ("branch", "--axis", "eps1=0:0.1"),
    ("map", SPUR, "--speed", "600 rpm:9000 rpm:2", "--torque", "60 N m:180 N m:2")])
def test_commands_write_tables(tmp_path, arguments):
    written = re.findall(r"wrote (.*)", ask(*arguments, "--out", tmp_path / "x.csv", code=0).stderr)
    assert written[0] == str(tmp_path / "x.csv") and {Path(w) for w in written} == {*tmp_path.iterdir()}


def test_export_of_a_store_run_with_other_axes(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("s.toml").write_text(STUDY)
    ask("run", "s.toml", "--axis", "omega=1:2:3", "--out", "s.zarr", "--tile", 4)
    ask("export", "s.zarr", "--out", "s.csv")
    ask("zones", "s.toml", "--axis", "omega=1:2:3", "--out", "z.csv")
    assert read("s.csv") == read("z.csv")  # the columns of a store have another order
    stored = gc.load("s.zarr")
    assert (stored.label.dims, stored.label.shape, stored.omega[0]) == (("eps1", "omega"), (7, 3), 1)
    pair = EXAMPLES / "physical_pair.toml"
    ask("run", pair, "--axis", "omega=0.9:1:2", "--axis", "q0=0.1:0.2:2", "--out", "p.zarr")
    ask("export", "p.zarr", "--out", "p.csv", "--physical")
    assert {"v_rms [mm/s]", "v_rms [m/s]"} <= read("p.csv").keys()
    assert "Save the result as NetCDF, --out FILE.nc" in refused("plot", "s.csv")
    assert "--axis must be given twice" in refused("run", "s.toml", "--axis", "q0=0:1:3", "--out", "t.zarr")
    Path("m.toml").write_text('[study]\nkind = "simulate"\nperiods = 4\n')
    assert "--axis must be left out for kind 'simulate'" in refused(
        "run", "m.toml", "--axis", "q0=0:1:3", "--out", "t.zarr")


def test_a_range_with_units_is_the_one_without():
    for speed in (1, 11, 22, 600, 1234.5):
        for text in (f"speed={speed} rpm:{2 * speed} rpm:5", f"speed={speed}:{2 * speed} 1/min:5"):
            assert gc.studies.core.axis.parse_axis(text) == gc.studies.Axis("speed", speed, 2 * speed, 5)
    assert gc.studies.core.axis.parse_axis("torque=1 kN*m:2000:3") == gc.studies.Axis("torque", 1000, 2000, 3)


def test_a_number_of_values_without_effect_is_warned_of():
    quiet = ask("branch", "--axis", "eps1=0:0.1")
    warned = ask("branch", "--axis", "eps1=0:0.1:400")
    assert "eps1=0:0.1:400 has no effect" in warned.stderr and "no effect" not in quiet.stderr
    assert warned.stdout == quiet.stdout
