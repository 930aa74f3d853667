"""Journals: whatever order they are read in and wherever they were cut, a store knows what is done."""

import itertools
import random

import numpy as np
import pytest

from gearchaos.store.files.folder import LocalFolder
from gearchaos.store.journals import journal as module
from gearchaos.store.journals.journal import (
    Begin,
    Damaged,
    Ended,
    Failed,
    Journal,
    Lost,
    Packed,
    TileEntry,
    decoded_line,
    encoded_line,
)
from gearchaos.store.journals.progress import Progress, WriterState
from gearchaos.store.tiles import Grid

GRID = Grid((8, 8), (2, 2), (4, 4), (4, 8))
"""Sixteen tiles in two groups of two chunks of four tiles."""


def entry(tile, at, segment="s"):
    return TileEntry(tile, segment, 0, 100, 7, 1.5, "box:1", 1, float(at))


def fresh(folder=None):
    return Progress(folder, GRID, lambda tile: 100)


def after(*lines):
    progress = fresh()
    for line in lines:
        progress.add(line)
    return progress


@pytest.fixture
def folder(tmp_path):
    return LocalFolder(tmp_path)


LINES = (
    Begin("box:1", {"numpy_version": "2"}, 1.0), entry(3, 2.0), TileEntry(0, None, 0, 0, 0, 1e-9, "é:1", 2, 3.25),
    Failed(4, 'ValueError: "no"\n', 3, "box:1", 4.0), Packed(1, {"label": (17, 2**32 - 1)}, 5.0),
    Lost([1, 2], [0], 6.0), Damaged([(1, "label")], [8], 7.0), Ended(8.0),
)


@pytest.mark.parametrize("line", LINES, ids=lambda line: line.kind)
def test_a_line_is_read_as_it_was_written(line):
    content = encoded_line(line)
    assert content.endswith(b"\n") and content.count(b"\n") == 1 and decoded_line(content[:-1]) == line


def test_no_changed_byte_of_a_line_is_accepted():
    content = encoded_line(LINES[1])[:-1]
    changed = (content[:i] + bytes([content[i] ^ 1]) + content[i + 1:] for i in range(len(content)))
    assert all(decoded_line(line) is None for line in changed)
    assert all(decoded_line(content[:i]) is None for i in range(len(content)))


def test_a_journal_is_read_once_and_then_what_was_added(folder, monkeypatch):
    progress, journal, reads = fresh(folder), Journal(folder, "all"), []
    true = LocalFolder.read

    def read(self, name, start=0):
        reads.append(start)
        return true(self, name, start)

    monkeypatch.setattr(LocalFolder, "read", read)
    journal.append(*LINES[:2])
    progress.refresh()
    size = folder.size("run/journal/all.jsonl")
    journal.append(entry(5, 9.0))
    progress.refresh()
    assert reads == [0, size] and sorted(progress.entries) == [3, 5]


def test_a_line_that_is_being_written_is_read_when_it_is_whole(folder):
    progress, content = fresh(folder), encoded_line(entry(3, 1.0)) + encoded_line(entry(4, 2.0))
    for cut in range(0, len(content), 7):
        folder.write("run/journal/all.jsonl", content[:cut])
        progress.refresh(["all"])
    assert progress.missing([3, 4]) == [4]
    folder.write("run/journal/all.jsonl", content)
    progress.refresh(["all"])
    assert progress.missing([3, 4]) == []


def test_a_writer_goes_on_after_one_that_was_killed_at_any_byte(folder):
    first, second = encoded_line(entry(3, 1.0)), encoded_line(entry(4, 2.0))
    for cut in range(len(second) + 1):
        folder.write("run/journal/all.jsonl", first + second[:cut])
        Journal(folder, "all").append(entry(5, 3.0))
        progress = fresh(folder)
        progress.refresh()
        assert sorted(progress.entries) == ([3, 4, 5] if cut >= len(second) - 1 else [3, 5])


def test_a_line_after_one_that_failed_is_whole(folder, monkeypatch):
    journal, true = Journal(folder, "all"), LocalFolder.append

    def cut_short(self, name, content):
        true(self, name, content[:10])
        raise OSError("no space")

    journal.append(entry(3, 1.0))
    monkeypatch.setattr(LocalFolder, "append", cut_short)
    with pytest.raises(OSError, match="no space"):
        journal.append(entry(4, 2.0))
    monkeypatch.undo()
    journal.append(entry(5, 3.0))
    progress = fresh(folder)
    progress.refresh()
    assert sorted(progress.entries) == [3, 5]


def test_long_journals_are_continued_in_new_files(folder, monkeypatch):
    monkeypatch.setattr(module, "LINES_PER_FILE", 5)
    monkeypatch.setattr("gearchaos.store.journals.progress.LINES_PER_FILE", 5)
    early = fresh(folder)
    for tile in range(16):
        if tile % 7 == 0:
            journal = Journal(folder, "2-of-3")
        journal.append(entry(tile, 1.0 + tile))
        early.refresh(["2-of-3"])
    late = fresh(folder)
    late.refresh()
    assert early.done_count == late.done_count == 16
    names = sorted(name.split("/")[-1] for name, _ in folder.list("run/journal"))
    assert names == ["2-of-3.1.jsonl", "2-of-3.2.jsonl", "2-of-3.3.jsonl", "2-of-3.jsonl"]


def state(progress):
    """All that a progress says."""
    return (progress.entries, progress.packed, progress.failed.keys(), progress.complete_groups(),
            progress.damaged_files(), progress.damaged_tiles(), np.isnan(progress.at).tolist())


STORIES = {
    "done twice": [entry(3, 2.0, "a"), entry(3, 5.0, "b")],
    "one of two records lost": [entry(3, 2.0, "a"), entry(3, 5.0, "b"), Lost([3], [], 2.0)],
    "both lost and done again": [entry(3, 2.0), entry(3, 5.0), Lost([3], [], 5.0), entry(3, 7.0)],
    "packed": [*(entry(t, 2.0 + t) for t in range(4)), Packed(0, {"a": (1, 2)}, 20.0)],
    "packed twice": [Packed(0, {"a": (1, 2)}, 20.0), Packed(0, {"a": (3, 4)}, 30.0), Lost([], [0], 20.0)],
    "packed, lost, saved": [entry(1, 2.0), Packed(0, {}, 20.0), Lost([], [0], 20.0), entry(1, 21.0), entry(2, 22.0)],
    "record lost before packing": [entry(1, 2.0), Lost([1], [], 2.0), entry(1, 4.0), Packed(0, {}, 20.0)],
    "record lost after packing": [Packed(0, {}, 20.0), entry(1, 2.0), Lost([1], [], 25.0), entry(1, 26.0)],
    "a slower copy after packing": [*(entry(t, 2.0 + t) for t in range(3)), Packed(0, {}, 20.0), entry(1, 21.0)],
    "damaged, lost, packed": [Packed(0, {}, 20.0), Damaged([(0, "a")], [1], 20.0), Lost([], [0], 20.0),
                              Packed(0, {}, 30.0)],
    "damaged": [Packed(0, {}, 20.0), Packed(1, {}, 22.0), Damaged([(0, "a"), (1, "b")], [1, 15], 22.0)],
    "all saved again": [Packed(0, {}, 20.0), Lost([], [0], 20.0), *(entry(t, 30.0 + t) for t in range(3))],
}


@pytest.mark.parametrize("lines", STORIES.values(), ids=STORIES)
def test_the_order_in_which_journals_are_read_does_not_matter(lines):
    expected = state(after(*lines))
    for order in itertools.permutations(lines):
        assert state(after(*order)) == expected


def test_the_order_does_not_matter_for_long_stories():
    rng = random.Random(1)
    kinds = [lambda at: entry(rng.randrange(16), at, str(at)), lambda at: Packed(rng.randrange(2), {"a": (1, at)}, at),
             lambda at: Lost([rng.randrange(16)], [], at - rng.randrange(5)),
             lambda at: Lost([], [rng.randrange(2)], at - rng.randrange(5)),
             lambda at: Damaged([(rng.randrange(2), "a")], [rng.randrange(16)], at - rng.randrange(5))]
    for _ in range(300):
        lines = [rng.choice(kinds)(at) for at in range(10, 10 + rng.randrange(30))]
        expected = state(after(*lines))
        for _ in range(5):
            rng.shuffle(lines)
            assert state(after(*lines)) == expected


def test_what_stories_say():
    assert after(*STORIES["done twice"]).entries[3].segment == "b"
    assert after(*STORIES["one of two records lost"]).entries[3].segment == "b"
    packed = after(*STORIES["packed"])
    assert packed.packed == {0: {"a": (1, 2)}} and packed.entries == {} and packed.done_count == 8
    slower = after(*STORIES["a slower copy after packing"])
    assert slower.packed == {0: {}} and slower.entries == {} and slower.done_count == 8
    slower.add(slower.loss([], [0]))
    assert slower.packed == {} and slower.entries == {} and slower.done_count == 0
    saved = after(*STORIES["packed, lost, saved"])
    assert saved.packed == {} and sorted(saved.entries) == [1, 2] and saved.done_count == 2
    assert after(*STORIES["damaged"]).damaged_files() == {0: {"a"}, 1: {"b"}}
    assert after(*STORIES["damaged"]).damaged_tiles() == {1, 15}
    assert after(*STORIES["damaged, lost, packed"]).damaged_files() == {}


def test_a_group_is_complete_when_its_last_tile_is_done_and_until_it_is_packed():
    progress = fresh()
    for tile in range(8):
        assert progress.complete_groups() == [] and progress.packed == {}
        progress.add(entry(tile, 1.0))
    assert progress.complete_groups() == [0] and not progress.all_done
    progress.add(Lost([2], [], 1.0))
    assert progress.complete_groups() == [] and progress.missing(range(9)) == [2, 8]
    progress.add(entry(2, 2.0))
    assert progress.complete_groups() == [0]
    progress.add(Packed(0, {}, 3.0))
    assert progress.complete_groups() == []


def test_computing_times_are_known_whichever_journal_is_read_first():
    lines = [*(entry(t, 2.0 + t) for t in range(8)), Packed(0, {}, 20.0)]
    for order in (lines, lines[::-1]):
        progress = after(*order)
        assert progress.seconds[:8].tolist() == [1.5] * 8 and progress.at[:8].tolist() == list(range(2, 10))


def test_done_wins_over_failed():
    for lines in itertools.permutations([entry(3, 2.0), Failed(3, "no", 3, "m:1", 5.0)]):
        assert after(*lines).failed == {} and after(*lines).done(3)
    assert after(Failed(3, "no", 3, "m:1", 5.0)).failed == {3: "no"}


def test_the_loss_of_what_is_done_voids_all_of_it():
    progress = after(entry(9, 4.0), entry(1, 2.0), entry(10, 6.0), Packed(0, {}, 5.0))
    progress.add(progress.loss([9], [0]))
    assert progress.done_count == 1 and sorted(progress.entries) == [10] and progress.packed == {}


def test_writers_say_whether_they_have_ended(folder):
    Journal(folder, "1-of-2").append(Begin("m:1", {}, 1.0), entry(3, 2.0), Ended(3.0))
    Journal(folder, "2-of-2").append(Begin("m:1", {}, 1.0), Ended(2.0), Begin("m:1", {}, 4.0))
    progress = fresh(folder)
    progress.refresh()
    assert progress.writers == {"1-of-2": WriterState(1.0, True, 3.0), "2-of-2": WriterState(4.0, False, 4.0)}
    Journal(folder, "1-of-2").append(Damaged([], [3], 5.0))  # by `gearchaos check`, which is not a run
    Journal(folder, "all").append(Lost([3], [], 5.0))
    Journal(folder, "2-of-2").append(Lost([3], [], 5.0))     # by the run that repairs
    progress.refresh()
    assert {name: state.ended for name, state in progress.writers.items()} == {
        "1-of-2": True, "2-of-2": False, "all": True}
