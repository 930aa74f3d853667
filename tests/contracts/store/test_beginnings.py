"""How a store begins: shards that begin at once, and folders that have other files."""

import shutil

import pytest

import gearchaos as gc
from gearchaos.errors import InputError
from gearchaos.store import run as module
from gearchaos.store.lock import Shard

MAP = gc.Zones(gc.MeshModel.of(q0=0.1), "omega=0.9:1.1:8", "eps1=0:0.01:8")


@pytest.mark.slow
def test_a_shard_that_begins_at_once_with_another_shares_its_store(tmp_path, monkeypatch):
    """The other one makes the store and computes all its tiles, while this one looks how large results are."""
    path, true = tmp_path / "map.zarr", module._create

    def late(*arguments):
        monkeypatch.setattr(module, "_create", true)
        assert module.run_into_store(MAP, path, tile=8, shard=Shard(2, 2)).missing.keys() == {"1/2"}
        true(*arguments)

    monkeypatch.setattr(module, "_create", late)
    outcome = module.run_into_store(MAP, path, tile=8, shard=Shard(1, 2))
    assert outcome.finished and outcome.done == outcome.count > 2
    assert gc.load(path).equals(gc.run(MAP))


def test_a_store_without_its_description_is_not_taken_for_a_folder_of_others(tmp_path):
    gc.run(MAP, out=tmp_path / "map.zarr")
    (tmp_path / "map.zarr/run/study.json").unlink()
    with pytest.raises(InputError, match=r"run/study\.json is missing"):
        gc.run(MAP, out=tmp_path / "map.zarr")
    shutil.rmtree(tmp_path / "map.zarr/run")
    with pytest.raises(InputError, match="It has other files, such as"):
        gc.run(MAP, out=tmp_path / "map.zarr")
