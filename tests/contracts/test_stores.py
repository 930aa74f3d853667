"""Stores whose files hold valid JSON of wrong content: counted as damaged or refused, wherever they are read."""

import json
import os
import shutil
import zlib

import numpy as np
import pytest
import xarray as xr

import gearchaos as gc
from gearchaos.dynamics import Classification
from gearchaos.store.reading.check import check
from gearchaos.store.reading.info import summary
from gearchaos.store.reading.missing import missing_parts
from gearchaos.store.record import from_record, to_record
from gearchaos.store.running.run import run
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


@pytest.fixture(scope="module")
def half(tmp_path_factory):
    """A store of which one of two shards has run."""
    path = tmp_path_factory.mktemp("half") / "map.zarr"
    run(small_map(), path, tile=16, shard="1/2")
    return path


def copy(whole, folder):
    return shutil.copytree(whole, folder / "copy.zarr")


def journal_of(path):
    return path / "run" / "journal" / "all.jsonl"


def lines_of(path):
    """The lines of the journal of a store by kind."""
    out = {}
    for content in journal_of(path).read_bytes().splitlines():
        if content:
            line = json.loads(content[9:])
            out.setdefault(line["kind"], []).append(line)
    return out


def append(path, *lines):
    """Append lines with right checksums and any content to the journal of a store."""
    with journal_of(path).open("ab") as file:
        for line in lines:
            content = line if isinstance(line, bytes) else json.dumps(line).encode()
            file.write(b"%08x %s\n" % (zlib.crc32(content), content))


TILE = {"kind": "tile", "tile": 2, "segment": None, "offset": 0, "length": 0, "crc": 0, "seconds": 1.0,
        "machine": "m:1", "attempt": 1, "at": 1.7e9}
NO_LINES = {
    "words for numbers": TILE | {"seconds": "long"}, "NaN": TILE | {"seconds": float("nan")}, "list": [1, 2],
    "infinite": TILE | {"at": float("inf")}, "missing": {"kind": "tile"}, "more": TILE | {"colour": "red"},
    "deep": json.loads("[" * 500 + "]" * 500), "number for a word": TILE | {"machine": 7},
    "word for a number": TILE | {"attempt": "1"}, "no attempt": TILE | {"attempt": 0}, "no kind": {"tile": 2},
    "unknown kind": TILE | {"kind": "moon"}, "no JSON": b"\xff\x00", "no such tile": TILE | {"tile": 10**6},
    "no such group": {"kind": "packed", "group": 77, "files": {}, "at": 1.7e9},
    "loss of no such tile": {"kind": "lost", "tiles": [10**6], "groups": [77], "at": 2e9},
    "damage of no such file": {"kind": "damaged", "files": [[77, "label"], [0, "moons"]], "tiles": [10**6], "at": 1.0},
    "record of another length": TILE | {"segment": "run/segments/x.bin", "length": 7, "at": 2e9},
}


@pytest.mark.parametrize("line", NO_LINES.values(), ids=NO_LINES)
def test_a_line_of_wrong_content_is_no_line(line, whole, tmp_path):
    path = copy(whole, tmp_path)
    append(path, line)
    assert summary(open_store(path)) | {"store": "", "bytes": 0, "writers": {}} == (
        summary(open_store(whole)) | {"store": "", "bytes": 0, "writers": {}})
    assert run(small_map(), path).done == open_store(path).grid.count
    xr.testing.assert_identical(open_store(path).dataset(), open_store(whole).dataset())


@pytest.mark.parametrize("damage", ["flipped", "cut short", "without line feed"])
def test_a_damaged_line_concerns_its_own_tile_alone(damage, half, tmp_path):
    path = copy(half, tmp_path)
    journal = path / "run" / "journal" / "1-of-2.jsonl"
    lines = journal.read_bytes().splitlines(keepends=True)
    number = next(i for i, line in enumerate(lines) if b'"kind":"tile"' in line)
    tile = json.loads(lines[number][9:])["tile"]
    lines[number] = {"flipped": lines[number][:30] + b"#" + lines[number][31:], "cut short": lines[number][:30] + b"\n",
                     "without line feed": lines[number][:-1]}[damage]
    journal.write_bytes(b"".join(lines))
    before, progress = open_store(half).progress(), open_store(path).progress()
    lost = {tile} if damage != "without line feed" else {tile, json.loads(lines[number + 1][9:]).get("tile", tile)}
    assert before.entries.keys() - progress.entries.keys() == lost
    run(small_map(), path)
    assert open_store(path).finished


NO_STUDIES = {
    "no tiles": ("grid", {"shape": [12, 16], "tile": [0, 4]}),
    "no multiple": ("grid", {"shape": [12, 16], "tile": [3, 4], "chunk": [4, 4], "group": [4, 4]}),
    "groups of half chunks": ("grid", {"shape": [12, 16], "tile": [3, 4], "chunk": [6, 4], "group": [9, 4]}),
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
    with pytest.raises(gc.InputError, match=r"To repair run/sums\.json: gearchaos finish"):
        open_store(path).dataset()
    run(small_map(), path)
    xr.testing.assert_identical(open_store(path).dataset(), open_store(whole).dataset())


def test_a_link_to_nothing_is_no_target(tmp_path):
    link = tmp_path / "link.zarr"
    link.symlink_to(tmp_path / "nowhere")
    with pytest.raises(gc.InputError, match=r"out must not be a link to nothing; got .*link.zarr"):
        run(small_map(), link)
    assert list(tmp_path.iterdir()) == [link]


PIPES = ("run/sums.json", "zarr.json", "label/zarr.json", "label/c/0/0", "run/journal/x.jsonl", "run/journal/all.jsonl")


@pytest.mark.parametrize("name", PIPES)
def test_a_pipe_in_a_store_counts_as_damage_and_nobody_waits_for_it(name, whole, tmp_path, no_waiting):
    path = copy(whole, tmp_path)
    (path / name).unlink(missing_ok=True)
    os.mkfifo(path / name)
    found = open_store(path)
    progress, own = found.progress(), "journal" not in name and "/c/" not in name
    assert found.damaged_files() == ([name] if own else [])
    assert progress.done_count == (0 if name.endswith("all.jsonl") else found.grid.count)
    assert missing_parts(found, progress).files == (["label/c/0/0"] if "/c/" in name else [])
    assert check(found).files == ([] if "journal" in name else [name])


def test_a_run_whose_journal_is_a_pipe_is_refused(whole, tmp_path, no_waiting):
    path = copy(whole, tmp_path)
    journal_of(path).unlink()
    os.mkfifo(journal_of(path))
    with pytest.raises(OSError, match=r"not a regular file.*all\.jsonl"):
        run(small_map(), path)


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


@pytest.mark.parametrize("part", ["chunk", "group"])
def test_groups_that_are_not_those_of_the_arrays_are_refused(part, whole, tmp_path):
    path = copy(whole, tmp_path)
    file = path / "run" / "study.json"
    words = json.loads(file.read_text())
    words["grid"][part][1] *= 2
    if part == "chunk":
        words["grid"]["group"][1] *= 2
    file.write_text(json.dumps(words))
    for action in (lambda: open_store(path).dataset(), lambda: run(small_map(), path)):
        with pytest.raises(gc.InputError, match=r"store must hold an undamaged run/study\.json; .*those of its arrays"):
            action()


def test_records_of_other_tiles_are_not_read(half, tmp_path):
    """If the size of tiles is edited, entries of other sizes are ignored, and their tiles computed again."""
    path = copy(half, tmp_path)
    file = path / "run" / "study.json"
    words = json.loads(file.read_text())
    words["grid"]["tile"][1] *= 2
    file.write_text(json.dumps(words))
    assert open_store(path).progress().done_count == 0
    run(small_map(), path)
    xr.testing.assert_identical(open_store(path).dataset(), small_map().run())


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
