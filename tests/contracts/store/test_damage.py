"""Damage of stores: it is named, never looks like a result, and is mended by the command that is named."""

import errno
import json
import os
import re
import shlex
import shutil
import warnings
from contextlib import suppress
from pkgutil import resolve_name
from uuid import uuid4

import numpy as np
import pytest
import xarray as xr
import zarr

import gearchaos as gc
from gearchaos.store.blocks import damaged_shards, work
from gearchaos.store.check import check, summary
from gearchaos.store.lock import Shard, write_lock
from gearchaos.store.objects import Objects
from gearchaos.store.run import finish_store, run
from gearchaos.store.store import STUDY, from_description, open_store
from tests.commands import ask
from tests.contracts.store.stores import BASINS, MAP, counted, describe, files, half_done

SHARD = "v_rms/c/0/1"
"""The results of the tiles 2, 3, 8 and 9, in two chunks."""

pytestmark = pytest.mark.usefixtures("instant")


@pytest.fixture
def path(made, tmp_path):
    return shutil.copytree(made, tmp_path / "map.zarr")


def damage(file, how):
    content = file.read_bytes()
    file.unlink()
    if how == "changed":
        middle = len(content) // 2
        file.write_bytes(content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1:])
    elif how == "cut short":
        file.write_bytes(content[:-1])


def assert_no_wrong_values(found, whole, warned):
    """Each value is right, or it is a fill value of which a warning has told."""
    for name, right in whole.variables.items():
        values = found[name].values
        wrong = ~((values == right.values) | ((values != values) & (right.values != right.values)))
        assert not wrong.any() or warned, name
        assert np.all(np.isnan(values[wrong]) if values.dtype.kind == "f" else values[wrong] == -1), name


def read(path, whole, plainly=False):
    """Read a store as gearchaos does, and perhaps as other programs do."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            assert_no_wrong_values(gc.load(path).load(), whole, said)
        except gc.InputError as error:
            assert str(path) in str(error) and "gearchaos" in str(error)
    with suppress(zarr.errors.BaseZarrError, RuntimeError, ValueError):
        assert not plainly or assert_no_wrong_values(xr.open_zarr(path).load(), whole, True) is None


DAMAGES = ["deleted", "changed", "cut short"]


def one_of_each_kind(names, number):
    """One of the objects whose names differ by numbers alone, for each kind; another one for another number."""
    kinds = {}
    for name in names:
        kinds.setdefault(re.sub(r"\d+", "", name), []).append(name)
    return [kind[number % len(kind)] for kind in kinds.values()]


@pytest.mark.slow
@pytest.mark.parametrize(("study", "how", "each"), [
    pytest.param(study, how, each, id=f"{study.kind} {how}{each * ' all'}",
                 marks=[pytest.mark.exhaustive] if each or (study is BASINS and how != "changed") else [])
    for study in (MAP, BASINS) for how in DAMAGES for each in (False, True)])
def test_damage_of_any_object_is_named_never_a_result_and_mended(study, how, each, tmp_path):
    run(study, path := tmp_path / "s.zarr", tile=8)
    before, whole, store = files(path), gc.load(path).load(), open_store(path)
    xr.testing.assert_identical(xr.open_zarr(path).load(), study.run())
    shards = {store.shard(n, b) for n in store.arrays for b in range(store.grid.block_count)}
    chosen = r"run/|[^/]*zarr.json|(items/)?(w|label|v_rms|z|eps1|attractor)/"
    names = [name for name in sorted(before) if re.match(chosen, name) and name != STUDY]
    few = ["items/w/zarr.json", "attractor/c/0/0"] if study is BASINS else ["v_rms/zarr.json", "eps1/c/0", SHARD]
    assert {"zarr.json", "run/zarr.json", "run/finished", "run/blocks/0", *few} <= set(names)
    if not each:  # what both studies have in common is damaged in that of the map
        own = r"items/|attractor/|zarr\.json|run/finished" if study is BASINS else ""
        names = one_of_each_kind([name for name in names if re.match(own, name)], DAMAGES.index(how))
    for name in names:
        damage(path / name, how)
        read(path, whole, name in shards)
        checked, told = ask("check", path), json.loads(ask("info", path, "--json").stdout)
        damaged = [] if (name, how) == ("run/finished", "deleted") else [name]  # it is not damaged, but not finished
        if study is BASINS and name == "run/finished":
            damaged.append("zarr.json")  # of the finished Dataset
        assert checked.exit_code == (1 if damaged else 0), name
        assert re.findall("damaged: (.*)\n", checked.stderr) == damaged
        assert not damaged or checked.stderr.endswith(f"To repair it: gearchaos finish {path}\n"), name
        if name not in shards or how != "changed":
            assert not told["finished"] and told["command"] == f"gearchaos finish {path}", name
            assert told["missing"]["files"] == damaged
        assert ask("finish", path).exit_code == 0 and files(path) == before, name
    assert ask("check", path).stdout == f"{path}: all checksums are right\n"


def test_a_damaged_shard_costs_its_own_block_and_variable_alone(path, made, monkeypatch):
    (path / SHARD).unlink()
    state = summary(open_store(path))
    assert (state["finished"], state["tiles_done"], state["tiles_lost"]) == (False, 8, 4)
    assert state["missing"] == {"tiles": 4, "files": [SHARD], "file_count": 1, "arrays": ["v_rms"],
                                "pieces": [{"eps1": [0, 8], "omega": [4, 8]}]}
    said = " ".join(ask("info", path).stdout.split())
    assert "12 of 12; 8 are whole (66.7%" in said and "files of v_rms are missing" in said
    assert "4 tiles that were done" in said and "by position from 0" in said and "damaged; to continue" in said
    assert "omega 4:8" in said and SHARD in said
    with pytest.warns(UserWarning, match=rf"v_rms are .* 4 of 12 tiles.*omega=4:8.*intact.*gearchaos finish {path}$"):
        found = gc.load(path)
    assert np.isnan(found.v_rms.values[:, 4:8]).all() and np.isfinite(found.v_rms.values[:, :4]).all()
    xr.testing.assert_identical(found.label, gc.load(made).label)
    assert f"{path}: files of v_rms are missing or damaged for 4 of 12 tiles" in ask("plot", path).stderr
    checked = ask("check", path, "--json")
    assert "tiles to be computed again, 4 in all: 2–3, 8–9\n" in checked.stderr
    assert json.loads(checked.stdout) == {"store": str(path), "damaged": True, "files": [SHARD],
                                          "tiles": [2, 3, 8, 9], "command": f"gearchaos finish {path}"}
    tiles = counted(monkeypatch)
    said = ask("finish", path).stderr
    assert f"results are missing or damaged, their blocks are computed again: {SHARD}\n" in said
    assert sorted(tiles) == [4, 6, 52, 54] and files(path) == files(made)


def test_no_changed_byte_of_a_shard_and_of_the_description_is_accepted(path):
    store, content = open_store(path), (path / SHARD).read_bytes()
    (path / SHARD).write_bytes(content[:5] + bytes([content[5] ^ 1]) + content[6:])  # in the first of two chunks
    found = gc.load(path)
    np.testing.assert_array_equal(found.v_rms[4:, 4:8], gc.run(MAP).v_rms[4:, 4:8])
    with pytest.raises(gc.InputError, match=r"store must be undamaged; .*v_rms/c/0/1 .*gearchaos check "):
        found.v_rms[:4, 4:8].load()
    for i in range(0, len(content), 5):
        (path / SHARD).write_bytes(content[:i] + bytes([content[i] ^ 1]) + content[i + 1:])
        assert damaged_shards(store, 1) == ["v_rms"]
    (path / SHARD).write_bytes((path / "v_rms/c/0/2").read_bytes())  # that of another block
    assert damaged_shards(store, 1) == ["v_rms"] and damaged_shards(store, 2) == []
    content = (path / STUDY).read_bytes()
    for i in range(len(content)):
        with pytest.raises(gc.InputError, match=r"undamaged run/study\.json|must have format 3"):
            from_description(store.objects, content[:i] + bytes([content[i] ^ 1]) + content[i + 1:])


@pytest.mark.parametrize("how", DAMAGES)
def test_damage_of_a_tile_is_named_never_a_result_and_mended(tmp_path, made, monkeypatch, how):
    path, true = half_done(tmp_path / "map.zarr", monkeypatch), gc.load(made).load()
    damage(path / "run/tiles/0/6", how)
    if how == "deleted":  # as if it had never been computed
        with pytest.warns(UserWarning, match="2 of 12 tiles are not computed"):
            assert_no_wrong_values(gc.load(path).load(), true, True)
        assert ask("check", path).exit_code == 0
    else:
        with pytest.warns(UserWarning, match="1 of 12 tiles"):
            found = gc.load(path)
        with pytest.raises(gc.InputError, match="a tile that is in no block yet does not have its checksum"):
            found.load()
        checked = ask("check", path)
        assert checked.exit_code == 1 and checked.stderr == (
            "damaged: run/tiles/0/6\ntiles to be computed again, 1 in all: 6\n"
            f"To repair it: gearchaos run STUDY.toml --out {path}\n")
    if how == "changed":  # all other tiles were computed
        work(str(path), 1, ("tile", 0))
        assert f"To repair it: gearchaos finish {path}\n" in ask("check", path).stderr
    tiles = counted(monkeypatch)
    mended = finish_store(path) if how == "changed" else run(MAP, path)
    assert mended.finished and sorted(tiles) == ([48] if how == "changed" else [0, 48])
    assert {n: c for n, c in files(path).items() if n != "run/failed/0"} == files(made)


@pytest.mark.slow
@pytest.mark.parametrize(("study", "name", "old", "new"), [
    (MAP, "label/zarr.json", b'"array"', b'"brray"'), (BASINS, "items/label/zarr.json", b'"shape": [', b'"shape": [1')])
def test_metadata_that_are_valid_json_of_wrong_content_are_written_again(tmp_path, study, name, old, new):
    run(study, path := tmp_path / "s.zarr")
    before = files(path)
    content = (path / name).read_bytes()
    assert old in content
    (path / name).write_bytes(content.replace(old, new, 1))
    assert ask("check", path).stderr == f"damaged: {name}\nTo repair it: gearchaos finish {path}\n"
    with pytest.raises(gc.InputError, match=f"To repair {name}: gearchaos finish"):
        gc.load(path)
    said = ask("finish", path)
    assert said.exit_code == 0 and f"damaged files of the store are written anew: {name}\n" in said.stderr
    assert files(path) == before


@pytest.mark.slow
@pytest.mark.parametrize("how", DAMAGES)
def test_a_damaged_description_is_mended_by_that_of_a_new_store(path, made, tmp_path, how):
    damage(path / STUDY, how)
    for command in ("info", "check", "finish", "plot"):
        said = ask(command, path)
        assert said.exit_code == 2 and "store must hold an undamaged run/study.json; got" in said.stderr
        assert "Copy run/study.json from a new store of the same study" in said.stderr
    with pytest.raises(gc.InputError, match="must hold an undamaged run/study"):
        run(MAP, path)
    run(MAP, tmp_path / "new.zarr", tile=8)
    shutil.copy(tmp_path / "new.zarr" / STUDY, path / STUDY)
    assert ask("finish", path).exit_code == 0 and files(path) == files(made)


def test_another_study_another_version_and_no_store_are_told(path, made, tmp_path, capsys, no_waiting):
    with pytest.raises(gc.InputError, match=r"store must hold the same study; .*q1: 0.1 in the store, 0.2 asked for"):
        run(gc.Zones(gc.MeshModel.of(q0=0.2), MAP.x, MAP.y), path)
    assert files(path) == files(made)
    describe(path, versions={**open_store(path).versions, "numpy_version": "1.0"})
    run(MAP, path, progress=True)
    assert "store was begun with other versions, numpy_version: '1.0' in the store" in capsys.readouterr().err
    describe(path, format=7)
    with pytest.raises(gc.InputError, match=r"store must have format 3; got 7.* another version of gearchaos"):
        gc.load(path)
    (path / STUDY).unlink()
    os.mkfifo(path / STUDY)
    with pytest.raises(gc.InputError, match="must hold an undamaged run/study"):
        open_store(path)
    shutil.rmtree(path / "run")
    with pytest.raises(gc.InputError, match="It has other files, such as"):
        run(MAP, path)
    for command in ("info", "check", "finish", "plot"):
        assert "store must be a folder that gearchaos run made" in ask(command, path).stderr
    for command in (["info"], ["check"], ["finish"], ["plot"], ["export", "--out", tmp_path / "map.nc"]):
        said = ask(*command, none := f"memory://{uuid4().hex}/none.zarr")
        assert said.exit_code == 2 and f"; got '{none}'" in said.stderr
        assert "must exist" in said.stderr or "must be a folder that gearchaos run made" in said.stderr
    said = ask("info", tmp_path / "none.zarr")
    assert said.exit_code == 2 and "compiles its kernels first" in said.stderr


@pytest.mark.slow
@pytest.mark.parametrize("make", [os.mkdir, os.mkfifo])
@pytest.mark.parametrize("name", ["zarr.json", "omega/c/0", SHARD, "run/blocks/0", "run/finished"])
def test_what_is_no_file_counts_as_damage_and_nobody_waits_for_it(path, made, make, name, no_waiting):
    (path / name).unlink()
    make(path / name)
    assert summary(open_store(path))["finished"] is False
    assert check(open_store(path))[0] == ([] if name == "run/finished" else [name])
    read(path, gc.load(made).load())
    try:
        finish_store(path)
    except OSError as error:  # a folder is not deleted
        assert name in str(error) and make is os.mkdir
        os.rmdir(path / name)
        finish_store(path)
    assert files(path) == files(made)


def test_a_store_that_must_not_be_written_to_is_read_and_named_with_what_is_needed(path, tmp_path, monkeypatch):
    def refuse(*_, **__):
        raise OSError(errno.EROFS, "Read-only file system", "/somewhere")

    for name in ("lock.SoftFileLock", "objects.Objects.put", "objects.Objects.delete", "objects.Objects.keep"):
        monkeypatch.setattr(f"gearchaos.store.{name}", refuse)
    said = ask("finish", path)
    assert said.exit_code == 2 and f"error: store must be writable; got '{path}'. " in said.stderr
    assert "Read-only file system" in said.stderr and "you may write in" in said.stderr
    for command in (["info"], ["check"], ["export", "--out", tmp_path / "map.nc"]):
        assert ask(*command, path).exit_code == 0
    assert gc.load(path).equals(gc.run(MAP))


@pytest.mark.parametrize("name", ["thesis.pdf", "data/zarr.json", "label/c/0/0"])
@pytest.mark.parametrize("kind", ["folder", "object store"])
def test_a_folder_of_others_is_refused_and_untouched(tmp_path, kind, name):
    mine = Objects(tmp_path / "mine" if kind == "folder" else f"memory://{uuid4().hex}/mine")
    mine.put(name, b"mine")
    with pytest.raises(gc.InputError, match=rf"store must be a new folder, or .*other files, such as {name}"):
        run(MAP, mine.url, tile=8)
    assert mine.names() == [name] and mine.get(name) == b"mine"


def test_a_creation_that_was_killed_is_begun_anew(tmp_path, made, monkeypatch):
    true, path = Objects.put, tmp_path / "map.zarr"
    for last in ("zarr.json", "omega/c/0", "v_rms/zarr.json", STUDY):
        def put(self, name, content, durable=False, last=last):
            if name == last:
                raise KeyboardInterrupt
            true(self, name, content, durable)

        with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
            patch.setattr(Objects, "put", put)
            run(MAP, path, tile=8)
        assert not (path / STUDY).exists()
        with write_lock(Objects(path), Shard()), pytest.raises(gc.InputError, match="the same command makes the store"):
            open_store(path)
    assert run(MAP, path, tile=8).finished and files(path) == files(made)


def test_what_killed_processes_left_is_cleared_and_own_files_of_the_user_survive(path, made):
    for name in (f"{SHARD}.{uuid4().hex}.partial", "run/tiles/0/6", "notes/mine.txt", "my.partial"):
        Objects(path).put(name, b"left")
    shutil.copytree(made, path / "inner.zarr")
    damage(path / "zarr.json", "changed")
    damage(path / SHARD, "changed")
    assert check(open_store(path))[0] == [SHARD, "zarr.json"] and run(MAP, path).finished
    own = {"notes/mine.txt": b"left", "my.partial": b"left"} | {f"inner.zarr/{n}": c for n, c in files(made).items()}
    assert {n: c for n, c in files(path).items() if not n.startswith("inner.zarr/run/blocks")} == files(made) | {
        n: c for n, c in own.items() if not n.startswith("inner.zarr/run/blocks")}


def meanwhile(monkeypatch, name, path, late=False):
    """Let another run finish a store when a function is called first: before what it does, or after it."""
    true = resolve_name(name)

    def function(*arguments):
        monkeypatch.setattr(name, true)
        found = true(*arguments) if late else None
        assert run(MAP, path).finished
        return found if late else true(*arguments)

    monkeypatch.setattr(name, function)


def test_blocks_that_are_written_during_a_check_are_not_damaged(tmp_path, monkeypatch):
    path = half_done(tmp_path / "map.zarr", monkeypatch)
    monkeypatch.setattr("gearchaos.store.check.cores", lambda: 1)
    meanwhile(monkeypatch, "gearchaos.store.check.read_tile", path)
    assert check(open_store(path))[0] == []


@pytest.mark.parametrize(("name", "opened"), [
    ("gearchaos.store.check.State.of", False), ("gearchaos.store.read.tiles_there", True)])
def test_blocks_that_are_written_while_a_store_is_opened_or_read_are_read(tmp_path, made, monkeypatch, name, opened):
    path = half_done(tmp_path / "map.zarr", monkeypatch)
    if not opened:
        meanwhile(monkeypatch, name, path, late=True)
    with pytest.warns(UserWarning, match="1 of 12 tiles are not computed"):
        found = gc.load(path)
    if opened:
        meanwhile(monkeypatch, name, path)
    assert found.load().equals(gc.load(made))


def test_commands_that_mend_are_for_a_shell(made, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(made, "my map's.zarr")
    damage(tmp_path / "my map's.zarr" / SHARD, "lost")
    command = shlex.split(summary(open_store("my map's.zarr"))["command"])
    assert command == ["gearchaos", "finish", "my map's.zarr"]
    assert ask(*command[1:]).exit_code == 0 and ask("check", "my map's.zarr").exit_code == 0
