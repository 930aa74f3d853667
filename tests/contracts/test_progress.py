"""What a store says of its run, from journals made by hand; and how work is divided."""

import shutil
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import nullcontext

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.dynamics import Classification
from gearchaos.errors import InputError
from gearchaos.execute import machine, pools, tiles
from gearchaos.execute.pool import Pool
from gearchaos.execute.progress import NotebookBar, bar
from gearchaos.store.files.folder import LocalFolder
from gearchaos.store.journals.journal import Failed, Journal, TileEntry
from gearchaos.store.layout.segments import SegmentWriter
from gearchaos.store.reading.info import summary
from gearchaos.store.reading.missing import missing_parts
from gearchaos.store.record import differences, from_record, to_record
from gearchaos.store.running import coordinator, create
from gearchaos.store.running import run as module
from gearchaos.store.store import open_store
from gearchaos.store.tiles import Grid, divide
from gearchaos.store.writers.locks import Shard
from gearchaos.studies.study import Study

SHORT = Classification(longest_transient=800, doublings=1, averaging_periods=16)
AXES = gc.Axis("omega", 0.5, 1.1, 8), gc.Axis("eps1", 0.05, 0.3, 6)
MAP = gc.Zones(gc.MeshModel.of(q0=0.1), *AXES, settings=SHORT)


class Made(Study):
    """A study of nothing, on a grid of our choice."""

    gridded, cost = True, None
    grid = block = {"x": 9}  # noqa: RUF012 -- they stand for properties

    def compute(self, items, **_):
        return {"label": items}

    def finish(self, found, **_):
        return found


def store_of(folder, tile=(2, 4)):
    assert create.create(LocalFolder(folder / "map.zarr"), MAP, Grid((6, 8), tile))
    return open_store(folder / "map.zarr")


def done(store, tiles, seconds=1.0):
    """Write the records of tiles that were done at the given times, with zeros, and note them in a journal."""
    writer, journal = SegmentWriter(store.folder, store.arrays), Journal(store.folder, "all")
    for number, at in tiles:
        zeros = {n: np.zeros((store.grid.size(number), *a.shape), a.dtype) for n, a in store.arrays.items()}
        journal.append(TileEntry(number, *writer.append(zeros), seconds, f"box{number}:17", 1, at))
    return journal


def test_a_summary_counts_what_the_journals_say(tmp_path):
    store = store_of(tmp_path)
    assert summary(store)["tiles"] == 6 and summary(store)["pieces_per_second"] is None
    done(store, ((0, 100.0), (1, 102.0), (2, 106.0), (4, 108.0)), 1.5).append(
        Failed(3, "ValueError: no", 3, "box0:18", 103.0))
    found = summary(store)
    size = sum(f.stat().st_size for f in store.folder.path.rglob("*") if f.is_file())
    assert found == {
        "store": str(store.folder.path), "study": "zones", "finished": False, "tiles": 6, "tiles_done": 4, "pieces": 48,
        "pieces_done": 32, "tiles_lost": 0, "failed": {"3": "ValueError: no"}, "seconds": 6.0,
        "pieces_per_second": 24 / 8,
        "seconds_left": 16 / 3, "machines": ["box0", "box1", "box2", "box4"], "bytes": size,
        "missing": {"tiles": 2, "groups": [], "files": [], "file_count": 0, "arrays": [],
                    "pieces": [{"eps1": [2, 6], "omega": [4, 8]}]},
        "writers": {"all": {"begun": 100.0, "ended": False, "at": 103.0, "running": None}},
    }


def test_the_rate_leaves_out_the_time_in_which_nothing_ran(tmp_path):
    """Four tiles a second apart, and a night before the last two."""
    store = store_of(tmp_path)
    done(store, enumerate((0.0, 1.0, 2.0, 3.0, 30_000.0, 30_001.0)))
    assert summary(store)["pieces_per_second"] == 4 * 8 / 4
    assert summary(store)["seconds_left"] == 0


@pytest.mark.parametrize(("pause", "counts"), [(19.9, True), (20.1, False)])
def test_a_pause_is_twenty_times_the_usual_step(tmp_path, pause, counts):
    store = store_of(tmp_path)
    done(store, enumerate(map(float, np.cumsum([0.0, 1.0, 1.0, 1.0, pause]))))
    expected = 4 * 8 / (3 + pause) if counts else 3 * 8 / 3
    assert summary(store)["pieces_per_second"] == pytest.approx(expected, rel=1e-9)


def test_a_tile_that_fails_is_tried_three_times_and_costs_no_time(tmp_path, monkeypatch):
    tries, true = [], coordinator.compute_tile

    def compute_tile(url, attempt, threads, tile):
        tries.append((tile, attempt))
        return "ValueError: no" if tile == 1 else true(url, attempt, threads, tile)

    monkeypatch.setattr(coordinator, "compute_tile", compute_tile)
    outcome = module.run_into_store(MAP, tmp_path / "map.zarr", tile=16)
    assert (outcome.done, outcome.failed, outcome.count) == (3, {1: "ValueError: no"}, 4)
    assert sorted(tries) == [(0, 1), (1, 1), (1, 2), (1, 3), (2, 1), (3, 1)]
    progress = open_store(tmp_path / "map.zarr").progress()
    assert progress.failed == {1: "ValueError: no"} and progress.seconds[1] == 0.0 and not progress.done(1)


def test_workers_that_outlive_a_store_compute_another_study_in_its_place(tmp_path):
    diagram = gc.Bifurcation(MAP.model, gc.Axis("omega", 0.5, 1.1, 8), settings=SHORT)
    with ThreadPoolExecutor(1) as workers:  # as those of a Dask scheduler
        for study in (MAP, diagram, MAP):
            shutil.rmtree(tmp_path / "study.zarr", ignore_errors=True)
            made = module.run_into_store(
                study, tmp_path / "study.zarr", tile=4, pool=lambda: nullcontext(Pool(workers, lambda: 1)))
            assert made.finished and made.done == made.count > 1
        assert gc.load(tmp_path / "study.zarr").equals(gc.run(MAP))


@pytest.mark.parametrize("good", [0, 4, 8])
def test_a_store_is_made_if_the_first_the_middle_or_the_last_piece_can_be_computed(good):
    class Failing(Made):
        def compute(self, items, **_):
            if items[0] != good:
                raise ArithmeticError("no")
            return {"label": items}

    assert create._sample(Failing(MAP.model), Grid((9,), (3,)))["label"].tolist() == [good]


@pytest.mark.parametrize("pool", [pools.process_pool, pools.thread_pool])
def test_no_pool_has_no_width(pool):
    with pytest.raises(InputError, match="must be a whole number of at least 1; got 0"):
        pool(0)


def test_a_study_of_one_tile_is_computed_with_its_store(tmp_path):
    store = store_of(tmp_path, (6, 8))
    progress = store.progress()
    assert progress.all_done and not progress.complete_groups() and 0 < progress.seconds[0] < 600
    assert not store.finished and missing_parts(store, progress).files == [] and store.damaged_files() == []
    assert store.study == MAP and (store.grid.shape, store.grid.tile) == ((6, 8), (6, 8))
    assert set(store.arrays) == set(MAP.run())
    np.testing.assert_array_equal(store.read("label"), MAP.run().label)


def test_cells_of_each_tile_are_a_rectangle():
    grid = Grid((5, 7), (2, 3))
    assert (grid.tiles, grid.count) == ((3, 3), 9)
    plane = np.arange(35).reshape(5, 7)
    for number in range(9):
        i, j = divmod(number, 3)
        part = plane[2 * i : 2 * i + 2, 3 * j : 3 * j + 3]
        np.testing.assert_array_equal(grid.items(number), part.ravel())
        assert grid.size(number) == part.size
        assert grid.position(number) == (i, j)


@pytest.mark.parametrize(("shape", "block", "size", "tile"), [
    ((100, 100), (1, 1), 64, (8, 8)), ((100, 100), (1, 1), 100, (8, 8)), ((100, 100), (1, 1), 128, (16, 8)),
    ((4, 1000), (1, 1), 256, (4, 64)), ((10, 50), (1, 50), 20, (1, 50)), ((10, 50), (1, 50), 200, (4, 50)),
])
def test_tiles_are_as_square_as_may_be(shape, block, size, tile):
    class Rectangle(Made):
        grid = dict(zip("yx", shape, strict=True))  # noqa: RUF012 -- it stands for a property

    Rectangle.block = dict(zip("yx", block, strict=True))
    assert divide(Rectangle(MAP.model), size) == Grid(shape, tile)


def test_shards_share_the_tiles_out():
    few, many = Grid((10,), (1,), (1,), (5,)), Grid((48,), (1,), (1,), (2,))
    assert [list(Shard(n, 3).tiles(few)) for n in (1, 2, 3)] == [[0, 3, 6, 9], [1, 4, 7], [2, 5, 8]]
    assert list(Shard(2, 3).tiles(many)) == [t for g in range(1, 24, 3) for t in (2 * g, 2 * g + 1)]
    assert Shard().name == "all" and Shard(2, 3).name == "2-of-3" and Shard.parse(" 2/3") == Shard(2, 3)


def test_differences_name_the_field_and_both_values():
    stored = {"kind": "zones", "model": {"zeta": 0.1, "J1": 2}, "axes": [1]}
    asked = {"kind": "zones", "model": {"zeta": 0.2, "J1": 2}, "axes": [2], "new": 1}
    assert differences(stored, asked) == [
        "axes: [1] in the store, [2] asked for", "model.zeta: 0.1 in the store, 0.2 asked for",
        "new: None in the store, 1 asked for",
    ]
    assert differences(stored, stored) == []


def test_a_study_is_recorded_whole_and_read_back():
    attractors = gc.Attractors(gc.MeshModel.of(), 9, sweep=gc.Axis("omega", 0.5, 2.0, 4))
    for study in (MAP, attractors, gc.Simulate(gc.MeshModel.of(eps1=0.1), 3)):
        assert from_record(to_record(study)) == study
    record = to_record(attractors)
    assert record["options"]["seed"] == 0 and "settings" not in record["options"]
    assert attractors.settings == Classification() and record["budget"]["patience"] == 10_000
    with pytest.raises(InputError, match="axes must be 1 for kind 'bifurcation'"):
        from_record(to_record(MAP) | {"kind": "bifurcation"})


def test_few_pieces_are_divided_evenly_among_threads():
    assert [t.stop - t.start for t in tiles.split(1000, threads=2)] == [500, 500]
    assert [t.stop - t.start for t in tiles.split(300, threads=2)] == [300]
    assert [t.stop - t.start for t in tiles.split(10_240, threads=2)] == [5120, 5120]
    assert [t.stop - t.start for t in tiles.split(1000, largest=100, threads=2)] == [100] * 10
    assert len(tiles.split(10_241, threads=2)) > 2


@pytest.mark.parametrize("threads", [2, 5])
@pytest.mark.parametrize("count", [60_000, 100_000])
def test_tiles_shrink_to_a_sixteenth_of_a_threads_share(count, threads):
    sizes = [t.stop - t.start for t in tiles.split(count, threads=threads)]
    least = count // (16 * threads)
    assert sizes[0] == min(tiles.TILE, count // (2 * threads))
    assert min(sizes[:-1]) == least and sizes[-1] <= least
    assert sizes[:-1] == sorted(sizes[:-1], reverse=True)


def test_cores_are_those_of_this_process(monkeypatch):
    monkeypatch.setattr(machine.os, "sched_getaffinity", lambda process: {0: {2, 5, 7}}[process])
    assert machine.cores() == 3
    monkeypatch.delattr(machine.os, "sched_getaffinity")
    monkeypatch.setattr(machine.os, "cpu_count", lambda: None)
    assert machine.cores() == 1


def test_work_handed_out_but_not_begun_is_dropped_when_nobody_waits_for_it():
    futures = []

    class Executor:
        def submit(self, work, item):
            futures.append(Future())
            if item == 0:
                futures[0].set_result(work(item))
            return futures[-1]

    running = Pool(Executor(), lambda: 2).results(lambda item: item + 5, range(10))
    item, future = next(running)
    assert (item, future.result()) == (0, 5)
    assert len(futures) == 4
    running.close()
    assert [f.cancelled() for f in futures] == [False, True, True, True]


def test_a_bar_begins_where_the_work_does(monkeypatch):
    from rich.progress import Progress

    begun, true = [], Progress.add_task

    def add_task(*arguments, **options):
        begun.append((options["total"], options["completed"]))
        return true(*arguments, **options)

    monkeypatch.setattr(Progress, "add_task", add_task)
    for done in ({}, {"done": 3}):
        with bar("work", 10, **done) as advance:
            advance(2)
    assert begun == [(10, 0), (10, 3)]


def test_what_does_not_fit_the_memory_is_refused_with_how_much_would():
    memory = machine.os.sysconf("SC_PAGE_SIZE") * machine.os.sysconf("SC_PHYS_PAGES")
    most = memory // 400
    machine.check_memory("cells", most)
    with pytest.raises(InputError, match=f"cells must be at most {most:,} on this machine"):
        machine.check_memory("cells", most + 1)


def test_the_bar_of_a_notebook_says_how_much_is_done_and_left(monkeypatch):
    shown = []
    monkeypatch.setattr(NotebookBar, "show", lambda self: shown.append(self.text))
    now = iter(np.arange(0.0, 100.0, 0.5))
    monkeypatch.setattr("gearchaos.execute.progress.time.monotonic", lambda: next(now))
    progress = NotebookBar("zo<nes", 1000, 400)
    progress.advance(100)
    assert shown[0] == "zo<nes 400/1,000"
    assert shown[1].startswith("zo<nes 500/1,000 · ") and shown[1].endswith(" s left")
    assert 'value="500" max="1000"' in progress.html and "zo&lt;nes" in progress.html


def test_updates_of_the_bar_of_a_notebook_are_not_more_frequent_than_a_reader_sees(monkeypatch):
    shown = []
    monkeypatch.setattr(NotebookBar, "show", lambda self: shown.append(self.done))
    monkeypatch.setattr("gearchaos.execute.progress.time.monotonic", lambda: 7.0)
    progress = NotebookBar("zones", 1000, 0)
    for _ in range(1000):
        progress.advance(1)
    assert shown == [0] and progress.done == 1000
