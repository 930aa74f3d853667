"""Stores whose files hold valid JSON of wrong content: counted as damaged or refused, wherever they are read."""

import json
import os
import shutil

import numpy as np
import pytest
import xarray as xr

import gearchaos as gc
from gearchaos.dynamics import Classification
from gearchaos.store.info import summary
from gearchaos.store.record import from_record, to_record
from gearchaos.store.run import run
from gearchaos.store.store import open_store

pytestmark = pytest.mark.slow


def small_map():
    axes = gc.Axis("omega", 0.5, 1.1, 16), gc.Axis("eps1", 0.05, 0.3, 12)
    return gc.Zones(gc.MeshModel.of(q0=0.1), *axes, settings=Classification(longest_transient=800, doublings=1,
        averaging_periods=16))


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A finished store of several tiles."""
    path = tmp_path_factory.mktemp("whole") / "map.zarr"
    run(small_map(), path, tile=32)
    return path


def copy(whole, folder):
    return shutil.copytree(whole, folder / "copy.zarr")


MARK = {"done": True, "seconds": 1.0, "machine": "m:1", "attempt": 1, "error": None, "at": 1.7e9}
NO_MARKS = {
    "words for numbers": MARK | {"seconds": "long"}, "NaN": MARK | {"seconds": float("nan")}, "list": [1, 2],
    "infinite": MARK | {"at": float("inf")}, "missing": {"done": True}, "more": MARK | {"colour": "red"},
    "deep": json.loads("[" * 500 + "]" * 500),
    "number for a word": MARK | {"machine": 7}, "word for a number": MARK | {"attempt": "1"},
    "no attempt": MARK | {"attempt": 0},
}


@pytest.mark.parametrize("mark", NO_MARKS.values(), ids=NO_MARKS)
def test_a_mark_of_wrong_content_is_no_mark(mark, whole, tmp_path):
    path = copy(whole, tmp_path)
    (path / "run" / "tiles" / "2.json").write_text(json.dumps(mark))
    store = open_store(path)
    assert 2 not in store.statuses() and summary(store)["tiles_done"] == store.grid.count - 1
    assert run(small_map(), path).done == open_store(path).grid.count


@pytest.mark.parametrize("name", ["77777", "-1", "01", "1e3", "9" * 30, "²"])
def test_a_mark_of_no_tile_is_no_mark(name, whole, tmp_path):
    path = copy(whole, tmp_path)
    (path / "run" / "tiles" / f"{name}.json").write_text(json.dumps(MARK))
    state = summary(open_store(path))
    assert state["tiles_done"] == state["tiles"] and state["pieces_done"] == state["pieces"]
    xr.testing.assert_identical(open_store(path).dataset(), open_store(whole).dataset())


NO_STUDIES = {
    "no tiles": ("grid", {"shape": [12, 16], "tile": [0, 4]}),
    "negative": ("grid", {"shape": [12, -16], "tile": [3, 4]}),
    "fewer dims": ("grid", {"shape": [12, 16], "tile": [3]}), "words": ("grid", {"shape": "twelve", "tile": [3, 4]}),
    "endless": ("grid", {"shape": [12, 10**40], "tile": [3, 4]}), "number": ("versions", {"numpy": 2}),
    "no numbers": ("arrays", {"label": {"dtype": "moons", "shape": []}}),
    "objects": ("arrays", {"a": {"dtype": "O", "shape": []}}),
    "elsewhere": ("arrays", {"../../label": {"dtype": "<f8", "shape": []}}), "null": ("study", None),
}


@pytest.mark.parametrize(("name", "content"), NO_STUDIES.values(), ids=NO_STUDIES)
def test_a_study_of_wrong_content_is_refused(name, content, whole, tmp_path):
    path = copy(whole, tmp_path)
    words = json.loads((path / "run" / "study.json").read_text())
    (path / "run" / "study.json").write_text(json.dumps(words | {name: content}))
    with pytest.raises(gc.InputError, match=rf"store must hold an undamaged run/study\.json; got .*damaged.*{name}"):
        open_store(path)


@pytest.mark.parametrize("grid", [{"shape": [12, 17], "tile": [3, 4]}, {"shape": [12, 16], "tile": [13, 16]}])
def test_a_grid_that_does_not_fit_the_study_is_refused(grid, whole, tmp_path):
    path = copy(whole, tmp_path)
    words = json.loads((path / "run" / "study.json").read_text())
    (path / "run" / "study.json").write_text(json.dumps(words | {"grid": grid}))
    for action in (lambda: open_store(path).dataset(), lambda: run(small_map(), path)):
        with pytest.raises(gc.InputError, match="do not fit the study's"):
            action()


@pytest.mark.parametrize("option", ["points", "budget", "colour"])
def test_an_option_that_the_study_does_not_have_is_refused(option):
    with pytest.raises(gc.InputError, match=rf"study option must be one of .*; got '{option}'"):
        from_record(to_record(small_map()) | {"options": {option: 3}})


@pytest.mark.parametrize("sums", ["{}", "[]", '{"zarr.json": "words"}', '{"zarr.json": NaN}', '{"../../x": 5}'])
def test_sums_of_wrong_content_are_written_anew(sums, whole, tmp_path):
    path = copy(whole, tmp_path)
    (path / "run" / "sums.json").write_text(sums)
    with pytest.raises(gc.InputError, match=r"Run it again to repair run/sums\.json"):
        open_store(path).dataset()
    run(small_map(), path)
    xr.testing.assert_identical(open_store(path).dataset(), open_store(whole).dataset())


def test_a_link_to_nothing_is_no_target(tmp_path):
    link = tmp_path / "link.zarr"
    link.symlink_to(tmp_path / "nowhere")
    with pytest.raises(gc.InputError, match=r"out must not be a link to nothing; got .*link.zarr"):
        run(small_map(), link)
    assert list(tmp_path.iterdir()) == [link]


PIPES = ("run/tiles/2.json", "run/tiles/77.json", "run/sums.json", "zarr.json", "label/zarr.json", "label/c/0/0")


@pytest.mark.parametrize("name", PIPES)
def test_a_pipe_in_a_store_counts_as_damage_and_nobody_waits_for_it(name, whole, tmp_path, no_waiting):
    path = copy(whole, tmp_path)
    (path / name).unlink(missing_ok=True)
    os.mkfifo(path / name)
    found, own = open_store(path), "tiles" not in name and "/c/" not in name
    assert found.statuses().keys() == open_store(whole).statuses().keys() - ({2} if name.endswith("/2.json") else set())
    assert found.damaged_files() == ([name] if own else [])
    assert own or found.damaged_tiles() == ([0] if "/c/" in name else [])


def test_a_store_whose_study_is_a_pipe_is_refused(whole, tmp_path, no_waiting):
    path = copy(whole, tmp_path)
    (path / "run" / "study.json").unlink()
    os.mkfifo(path / "run" / "study.json")
    with pytest.raises(gc.InputError, match=r"store must be a folder that gearchaos run made; .*not a regular file"):
        open_store(path)


@pytest.mark.parametrize("name", ["omega/c/0", "eps1/c/0"])
def test_sums_that_do_not_name_every_own_file_are_written_anew(name, whole, tmp_path):
    path = copy(whole, tmp_path)
    file, kept = path / "run" / "sums.json", open_store(whole).dataset()
    file.write_text(json.dumps({n: s for n, s in json.loads(file.read_text()).items() if n != name}))
    (path / name).write_bytes((path / name).read_bytes()[::-1])
    assert open_store(path).damaged_files() == ["run/sums.json"]
    run(small_map(), path)
    xr.testing.assert_identical(open_store(path).dataset(), kept)


def test_a_file_that_is_no_part_of_a_store_does_no_harm(whole, tmp_path):
    path = copy(whole, tmp_path)
    (path / "notes.txt").write_text("mine")
    assert open_store(path).damaged_files() == []


def test_tiles_that_are_not_those_of_the_arrays_are_refused(whole, tmp_path):
    path = copy(whole, tmp_path)
    file = path / "run" / "study.json"
    words = json.loads(file.read_text())
    words["grid"]["tile"][1] *= 2
    file.write_text(json.dumps(words))
    for action in (lambda: open_store(path).dataset(), lambda: run(small_map(), path)):
        with pytest.raises(gc.InputError, match=r"store must hold an undamaged run/study\.json; .*those of its arrays"):
            action()


@pytest.mark.parametrize("make", [os.mkdir, os.mkfifo])
@pytest.mark.parametrize("name", ["zarr.json", "omega/zarr.json", "omega/c/0"])
def test_what_is_no_file_where_one_must_be_is_refused(make, name, whole, tmp_path, no_waiting):
    path = copy(whole, tmp_path)
    (path / name).unlink()
    make(path / name)
    with pytest.raises(gc.InputError, match=rf"store must be undamaged; .*repair .*{name}"):
        open_store(path).dataset()
    with pytest.raises(gc.InputError, match=rf"store must have a file at this path; got '.*{name}'.* Remove it"):
        run(small_map(), path)


def test_a_file_where_a_folder_must_be_is_refused(whole, tmp_path):
    path = copy(whole, tmp_path)
    shutil.rmtree(path / "omega")
    (path / "omega").write_text("mine")
    with pytest.raises(gc.InputError, match=r"store must have a folder at this path; got '.*omega'.* Remove it"):
        run(small_map(), path)


def test_what_is_not_a_store_s_own_survives_its_repair(tmp_path):
    study = gc.Basins(gc.MeshModel.of(kind="single"), "z=-1:1:3", "z_dot=-1:1:2",
                      settings=Classification(longest_transient=0, doublings=0))
    path = tmp_path / "b.zarr"
    gc.run(study, path)
    (path / "notes").mkdir()
    (path / "notes" / "mine.txt").write_text("kept")
    gc.run(study, path / "inner.zarr")
    (path / "zarr.json").write_bytes((path / "zarr.json").read_bytes() + b" ")
    gc.run(study, path)
    assert (path / "notes" / "mine.txt").read_text() == "kept"
    assert open_store(path / "inner.zarr").finished and open_store(path).finished


@pytest.mark.parametrize("study", [
    gc.Attractors(gc.MeshModel.of(kind="single", q0=0.1, eps1=0.15), 24, settings=Classification(doublings=1)),
    gc.Basins(gc.MeshModel.of(kind="single", q0=0.1, eps1=0.15), "z=-3:3:6", "z_dot=-2:2:4"),
], ids=lambda study: study.kind)
def test_motions_that_an_unfinished_run_has_not_computed_are_no_attractor_and_in_no_share(study, tmp_path):
    run(study, tmp_path / "s.zarr", tile=4, shard="1/2")
    half, all_motions = open_store(tmp_path / "s.zarr").dataset(), study.run()
    known = half["attractor"].values != -2
    assert 8 <= known.sum() < 24 and (half["attractor"].values[known] >= 0).any()
    counts = [np.sum(half["attractor"].values == n) for n in half["number"].values]
    assert half["attractor_fraction"].values.tolist() == [c / known.sum() for c in counts]
    assert not np.any(all_motions["attractor"] == -2)
