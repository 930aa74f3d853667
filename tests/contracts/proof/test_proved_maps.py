"""Maps with proofs: the same results on any number of workers, in stores, and with certificates that are verified."""

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from tests.commands import ask

pytest.importorskip("flint")

import gearchaos as gc
from gearchaos.dynamics import Reason
from gearchaos.errors import InputError
from gearchaos.model import MeshModel
from gearchaos.proof import batch
from gearchaos.proof.certificate import INFERRED, NO_REASON, REASON_CODES, REASONS
from gearchaos.proof.verifier import verify_file
from gearchaos.studies.proofs import proved_cells
from gearchaos.studies.proofs.proved_cells import proof_counts

MODEL = MeshModel.of(kind="torsional", q0=0.1)
X, Y = "omega=1.2:1.8:4", "eps1=0.1:0.25:3"
STUDY = f"""
[model]
q0 = 0.1
[study]
kind = "zones"
x = "{X}"
y = "{Y}"
prove = true
"""


@pytest.fixture(scope="module")
def proved(tmp_path_factory):
    folder = tmp_path_factory.mktemp("certificates")
    return gc.zones(MODEL, X, Y, prove=True, certificates=str(folder), threads=1), folder


def test_every_periodic_cell_is_proved_and_no_other(proved):
    found, _ = proved
    np.testing.assert_array_equal(found["proved"], np.where(found["period"] > 0, 1, -1))
    np.testing.assert_array_equal(found["proof_reason"], NO_REASON)
    assert (found["proved"] == -1).any()
    plain = gc.zones(MODEL, X, Y)
    assert set(found) - set(plain) == {"proved", "proof_reason"}
    xr.testing.assert_equal(found[list(plain)], plain)


def test_certificates_of_the_proved_cells_are_written_and_verified(proved):
    found, folder = proved
    cells = {(int(f.parent.name[3:]), int(f.stem[6:])): f for f in folder.glob("row*/column*.json")}
    assert set(cells) == {(i, j) for i, j in np.argwhere(found["proved"].values == 1).tolist()}
    for (i, j), file in cells.items():
        assert verify_file(file).proved
        document = json.loads(file.read_text())
        assert document["period"] == found["period"].values[i, j]
        assert float.fromhex(document["model"]["omega"]) == found["omega"].values[j]
        assert float.fromhex(document["model"]["eps"][0]) == found["eps1"].values[i]
    assert (folder / "verifier.py").is_file()


@pytest.mark.slow
def test_a_store_holds_the_same_proofs_and_goes_on_where_it_stopped(proved, tmp_path):
    store, found = tmp_path / "map.zarr", proved[0]
    study = gc.Zones(MODEL, X, Y, prove=True)
    first = gc.run(study, store, shard="2/2", tile=4, threads=2)
    with xr.open_zarr(store) as begun:
        assert 0 < first.done < first.count and (begun["proved"] == -1).sum() > (found["proved"] == -1).sum()
    assert gc.run(study, store, processes=2).done == first.count
    with xr.open_zarr(store) as finished:
        xr.testing.assert_equal(finished[["proved", "proof_reason"]].load(), found[["proved", "proof_reason"]])


def test_the_command_run_counts_the_proofs(tmp_path):
    (tmp_path / "study.toml").write_text(STUDY)
    result = ask("run", tmp_path / "study.toml", "--out", tmp_path / "map.zarr", "--threads", "1", "--json", code=0)
    counts = json.loads(result.stdout.splitlines()[-1])["proofs"]
    assert counts["periodic"] == counts["proved"] > 0 and counts["unproved"] == {} and counts["share"] == 1
    assert f"proved {counts['proved']} of {counts['periodic']} periodic cells (100.00 %)" in result.stderr


def test_inferred_cells_are_not_proved():
    found = gc.zones(MODEL, "omega=2.6:3:9", "eps1=0:0.02:9", refine=8, prove=True)
    inferred = found["inferred"].values == 1
    assert inferred.any() and (found["reason"].values[inferred] == Reason.INFERRED).all()
    np.testing.assert_array_equal(found["proved"].values, np.where(inferred, 0, 1))
    np.testing.assert_array_equal(found["proof_reason"].values, np.where(inferred, INFERRED, NO_REASON))
    counts = proof_counts([found])
    assert counts["unproved"] == {"inferred": int(inferred.sum())} and counts["periodic"] == 81


def test_a_failed_proof_is_recorded_with_its_reason(monkeypatch):
    monkeypatch.setattr(proved_cells, "sections", lambda flow, w, points, period: [
        np.full((n, 2), 0.31) for n in period.tolist()])
    found = gc.zones(MODEL, "omega=2.6:2.8:2", "eps1=0:0.01:2", prove=True)
    np.testing.assert_array_equal(found["proved"], 0)
    reasons = {REASON_CODES[code] for code in found["proof_reason"].values.ravel().tolist()}
    assert reasons <= {"Newton diverged", "tangency undecided"}


@pytest.mark.parametrize("threads", [1, 3])
def test_each_orbit_gets_its_own_result(monkeypatch, threads):
    monkeypatch.setattr(proved_cells, "_BATCH", 7)
    monkeypatch.setattr(proved_cells, "prove_in_process", lambda orbits: np.array(
        [(len(orbit.points) % 2, len(orbit.points)) for orbit in orbits], np.int8))
    periods = np.random.default_rng(0).integers(0, 40, 100)
    orbits = np.full(100, None, dtype=object)
    for i in np.flatnonzero(periods):
        orbits[i] = np.zeros((periods[i], 2))
    found = proved_cells.proofs([MODEL] * 100, orbits, [None] * 100, threads=threads)
    np.testing.assert_array_equal(found["proof_reason"], periods)
    np.testing.assert_array_equal(found["proved"], np.where(periods > 0, periods % 2, -1))


def test_every_reason_has_a_code_that_files_of_results_keep():
    assert REASON_CODES == {
        0: "none", 1: "inferred", 2: "Newton diverged", 3: "section on the contact boundary", 4: "tangency undecided",
        5: "windows overlap", 6: "too many switches", 7: "Krawczyk not contracting", 8: "period not minimal",
        9: "neutral", 10: "bits exhausted", 11: "too many steps"}
    assert set(REASONS) == set(REASON_CODES.values()) - {"none", "inferred"}


def test_the_error_of_a_process_is_told():
    with pytest.raises(RuntimeError, match="the process that proves orbits failed"):
        batch.prove_in_process([("no model", np.zeros((1, 2)), None)])


@pytest.mark.parametrize(
    ("options", "message"),
    [({"prove": 1}, "prove must be true or false"), ({"certificates": "x"}, "certificates needs prove = true"),
     ({"prove": True, "certificates": 3}, "certificates must be a text"),
     ({"prove": True, "certificates": __file__}, "certificates must be a folder")])
def test_wrong_options_are_named(options, message):
    with pytest.raises(InputError, match=message):
        gc.Zones(MODEL, X, Y, **options)


def test_certificates_of_an_earlier_map_are_removed(tmp_path):
    """A cell whose motion is not proved in this map has no certificate of another one."""
    first = proved_cells.certificate_files(str(tmp_path), np.arange(6), 3)
    for file in first:
        Path(file).write_text("{}")
    assert proved_cells.certificate_files(str(tmp_path), np.array([1, 4]), 3) == [first[1], first[4]]
    assert sorted(map(str, tmp_path.glob("row*/*.json"))) == sorted(first[i] for i in (0, 2, 3, 5))
