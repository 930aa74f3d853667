"""Tiles, records and group files: Zarr reads what is written, and damage is found by the tile that it concerns."""

import itertools
import os
import shutil
import threading
from dataclasses import dataclass, replace
from math import prod

import numpy as np
import pytest
import zarr

from gearchaos.store.files.folder import LocalFolder
from gearchaos.store.journals.journal import Lost, Packed, TileEntry
from gearchaos.store.layout import groups, segments
from gearchaos.store.layout.chunks import CODECS, DamagedChunkError, decoded, encoded, group_file, padded
from gearchaos.store.layout.groups import DamagedRecordsError, damaged_chunks, pack, unpack, write_group
from gearchaos.store.layout.segments import SegmentWriter, read_parts, record_is_intact
from gearchaos.store.layout.specs import ArraySpec, not_computed
from gearchaos.store.reading.missing import MissingParts, missing_parts
from gearchaos.store.store import Store
from gearchaos.store.tiles import Grid, grouped

ARRAYS = {"label": ArraySpec("|i1", ()), "period": ArraySpec("<i4", ()), "v_rms": ArraySpec("<f8", ()),
          "section": ArraySpec("<f8", (3,)), "multiplier": ArraySpec("<c16", (2,))}
GRID = Grid((10, 13), (2, 3), (4, 6), (8, 12))
"""Tiles, chunks and groups that are cut off at both ends of the grid: 25 tiles in four groups."""


@dataclass(frozen=True)
class Numbers:
    """A study with the grid of `GRID`."""

    gridded = True
    grid = {"y": 10, "x": 13}  # noqa: RUF012 -- it stands for a property
    block = {"y": 1, "x": 1}  # noqa: RUF012 -- it stands for a property


def values(name):
    """The results of all work items in one array; some chunks hold the fill value alone."""
    spec, shape = ARRAYS[name], (*GRID.shape, *ARRAYS[name].shape)
    out = (50 * np.random.default_rng(len(name)).standard_normal(shape)).astype(spec.dtype)
    out[:4, :6] = not_computed(name, np.dtype(spec.dtype), 2)
    return out


VALUES = {name: values(name) for name in ARRAYS}


@pytest.fixture
def store(tmp_path):
    return Store(LocalFolder(tmp_path / "s.zarr"), Numbers(), GRID, ARRAYS, {})


def results(tile):
    return {n: v[GRID.region(tile)].reshape(-1, *ARRAYS[n].shape) for n, v in VALUES.items()}


def append(store, tiles, writer=None):
    """The entries of tiles whose records are appended to a segment."""
    writer = writer or SegmentWriter(store.folder, store.arrays)
    return {t: TileEntry(t, *writer.append(results(t)), 1.0, "m:1", 1, 1.0 + t) for t in tiles}


def progress_of(store, *lines):
    progress = store.progress()
    for line in lines:
        progress.add(line)
    return progress


def pack_all(store):
    """The progress of a store of which all groups are packed."""
    entries = append(store, range(GRID.count))
    files = {g: pack(store, g, [entries[t] for t in GRID.tiles_of(g)]) for g in range(GRID.group_count)}
    return progress_of(store, *entries.values(), *(Packed(g, f, 100.0) for g, f in files.items()))


@pytest.mark.parametrize("grid", [
    GRID, Grid((5, 7), (2, 3)), Grid((300,), (64,), (128,), (256,)), Grid((300,), (64,), (300,), (300,)),
    Grid((1, 9), (1, 9)), Grid((4, 4), (4, 1), (4, 2), (4, 4)), Grid((6, 100), (2, 8), (6, 16), (6, 32)),
], ids=str)
def test_tiles_chunks_and_groups_cover_the_grid_once_and_lie_in_each_other(grid):
    owner, chunk = np.full(grid.shape, -1), np.zeros(grid.shape, int)
    for group in range(grid.group_count):
        assert np.all(owner[grid.group_region(group)] == -1)
        owner[grid.group_region(group)] = group
        for _, region in grid.chunk_regions(group):
            chunk[region] += 1
            assert set(grid.tiles_in(region)) <= set(grid.tiles_of(group))
        assert grid.tile_count(group) == len(grid.tiles_of(group))
        assert grid.groups_in(grid.group_region(group)) == [group]
    assert np.all(chunk == 1) and np.all(owner >= 0)
    items = [grid.items(t) for t in range(grid.count)]
    assert sorted(np.concatenate(items)) == list(range(prod(grid.shape)))
    for tile in range(grid.count):
        assert set(owner[grid.region(tile)].ravel()) == {grid.group_of(tile)}
        assert tile in grid.tiles_of(grid.group_of(tile)) and grid.size(tile) == len(items[tile])
    assert sorted(itertools.chain(*map(grid.tiles_of, range(grid.group_count)))) == list(range(grid.count))


@pytest.mark.parametrize(("shape", "tile", "item_bytes", "chunk", "group"), [
    ((31623, 31623), (128, 128), 8, (512, 256), (1024, 1024)), ((1000, 1000), (128, 128), 8, (512, 256), (1024, 1024)),
    ((12, 16), (8, 4), 8, (12, 16), (12, 16)), ((100_000,), (64,), 1024, (1024,), (8192,)),
    ((2048, 2048), (512, 512), 8, (512, 512), (1024, 1024)), ((10, 50_000), (4, 50_000), 8, (4, 50_000), (12, 50_000)),
    ((10**6, 10**6), (128, 128), 8, (512, 256), (4096, 4096)), ((7, 7), (7, 7), 0, (7, 7), (7, 7)),
])
def test_chunks_have_a_mebibyte_and_groups_eight_unless_there_are_too_many(shape, tile, item_bytes, chunk, group):
    grid = grouped(Grid(shape, tile), item_bytes)
    assert (grid.tile, grid.chunk, grid.group) == (tile, chunk, group)


def test_a_billion_cells_are_twenty_thousand_files():
    assert 21 * grouped(Grid((31623, 31623), (128, 128)), 8).group_count == 21 * 31**2 == 20_181


def test_what_is_not_computed_looks_like_no_result():
    kinds = {"|i1": -1, "<i4": -1, "<u2": 65535, "<f4": np.nan, "<c16": np.nan}
    for dtype, expected in kinds.items():
        np.testing.assert_equal(not_computed("label", np.dtype(dtype), 2), expected)
    assert [not_computed(n, np.dtype("i1"), 1) for n in ("label", "contact", "proved")] == [0, -1, -1]


def test_parts_of_records_are_read_array_by_array(store, monkeypatch):
    entries, reads = append(store, (7, 3, 24)), []
    true = LocalFolder.read
    monkeypatch.setattr(LocalFolder, "read", lambda self, *at: (reads.append(at), true(self, *at))[1])
    for gap, count in ((2**16, 1), (0, 3)):
        monkeypatch.setattr(segments, "_GAP", gap)
        for name, whole in VALUES.items():
            reads.clear()
            found = {e.tile: part for e, part in read_parts(store.folder, entries.values(), ARRAYS, name, GRID)}
            assert len(reads) == count
            for tile in entries:
                np.testing.assert_array_equal(found[tile], whole[GRID.region(tile)])
                assert found[tile].dtype == whole.dtype


def test_no_changed_byte_of_a_record_is_accepted(store):
    entry = append(store, [24])[24]
    content = store.folder.read(entry.segment)
    assert len(content) == entry.length == store.record_length(24)
    for i in range(0, len(content), 3):
        store.folder.write(entry.segment, content[:i] + bytes([content[i] ^ 4]) + content[i + 1:])
        damaged = [n for n in ARRAYS if next(read_parts(store.folder, [entry], ARRAYS, n, GRID))[1] is None]
        assert len(damaged) == 1 and not record_is_intact(store.folder, entry)
    store.folder.write(entry.segment, content[:-1])
    assert not record_is_intact(store.folder, entry)


def test_a_record_of_another_tile_of_the_same_size_is_not_accepted(store):
    """The checksum of a record differs from that of other records, though both contain their own checksums."""
    entries = append(store, (6, 7))
    assert entries[6].crc != entries[7].crc
    moved = TileEntry(6, entries[7].segment, entries[7].offset, entries[7].length, entries[6].crc, 1.0, "m:1")
    assert record_is_intact(store.folder, entries[7]) and not record_is_intact(store.folder, moved)


@pytest.mark.parametrize("wrong", [{"segment": "a\0b"}, {"segment": "/"}, {"offset": 2**63 - 1}])
def test_a_record_where_no_file_can_have_one_is_missing(store, wrong):
    entry = replace(append(store, [6])[6], **wrong)
    assert not record_is_intact(store.folder, entry)
    for name in ARRAYS:
        assert list(read_parts(store.folder, [entry], ARRAYS, name, GRID)) == [(entry, None)]


def test_segments_are_continued_in_new_files(store, monkeypatch):
    monkeypatch.setattr(LocalFolder, "segment_size", 2 * store.record_length(0))
    entries = append(store, (0, 1, 2, 3, 5, 6, 7))
    names = [entry.segment for entry in entries.values()]
    assert [len(list(g)) for _, g in itertools.groupby(names)] == [2, 2, 2, 1] and len(set(names)) == 4
    monkeypatch.setattr(LocalFolder, "segment_size", 0)
    assert len({entry.segment for entry in append(store, range(3)).values()}) == 3


def test_a_segment_that_was_deleted_meanwhile_begins_again(store):
    writer = SegmentWriter(store.folder, ARRAYS)
    first = append(store, [3], writer)[3]
    store.folder.delete(first.segment)
    again = append(store, [4], writer)[4]
    assert (again.segment, again.offset) == (first.segment, 0) and record_is_intact(store.folder, again)


def zarr_array(folder, name, grid=GRID):
    spec = ARRAYS[name]
    return zarr.create_array(
        LocalFolder(folder).zarr_store(read_only=False), name=name, shape=(*grid.shape, *spec.shape),
        shards=(*grid.group, *spec.shape), chunks=(*grid.chunk, *spec.shape), dtype=spec.dtype, compressors=CODECS,
        fill_value=not_computed(name, np.dtype(spec.dtype), 2),
    )


def files(folder):
    return {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


@pytest.mark.parametrize("name", ARRAYS)
def test_group_files_are_the_shards_that_zarr_writes(store, tmp_path, name):
    """But for chunks that hold the fill value alone, which Zarr leaves out by default, and a store never."""
    full = np.where(VALUES[name] == VALUES[name], VALUES[name], 1)
    full[full == -1] = 1
    theirs = zarr_array(tmp_path / "theirs", name)
    theirs[:] = full
    for group in range(GRID.group_count):
        write_group(store, group, name, full[GRID.group_region(group)])
    shards = {n: c for n, c in files(tmp_path / "theirs").items() if "c" in n.parts}
    assert files(store.folder.path) == shards and len(shards) == 4


@pytest.mark.parametrize("name", ARRAYS)
def test_zarr_reads_what_is_packed(store, name):
    zarr_array(store.folder.path, name)
    pack_all(store)
    np.testing.assert_array_equal(zarr.open_array(store.folder.path / name, mode="r")[:], VALUES[name])


@pytest.mark.parametrize("counts", [(2, 2), (1, 8), (5, 3), (4, 4, 1), (7,)])
def test_chunks_lie_in_the_order_of_zarr(counts):
    from zarr.core.indexing import morton_order_iter

    content = {position: str(position).encode() for position in np.ndindex(counts)}
    assert group_file(content, counts).startswith(b"".join(content[p] for p in morton_order_iter(counts)))


def test_a_chunk_is_decoded_as_it_was_encoded_and_no_changed_byte_is_accepted():
    numbers = padded(VALUES["v_rms"][8:, 12:], (4, 6), np.nan)
    content = encoded(numbers)
    np.testing.assert_array_equal(decoded(content, numbers.dtype, (4, 6)), numbers)
    bad = [content[:i] + bytes([content[i] ^ 1]) + content[i + 1:] for i in range(len(content))]
    for damaged in [*bad, content[:-1], content[:3], b"", encoded(numbers[:2])]:
        with pytest.raises(DamagedChunkError):
            decoded(damaged, numbers.dtype, (4, 6))


def test_a_store_is_read_from_groups_segments_and_fill_values(store):
    entries = append(store, [*GRID.tiles_of(0), 4, 20])
    files = pack(store, 0, [entries[t] for t in GRID.tiles_of(0)])
    progress = progress_of(store, *entries.values(), Packed(0, files, 100.0))
    for name, whole in VALUES.items():
        expected = np.full_like(whole, store.fill(name))
        for tile in entries:
            expected[GRID.region(tile)] = whole[GRID.region(tile)]
        np.testing.assert_array_equal(store.read(name, None, progress), expected)
        for region in ((slice(3, 9), slice(5, 13)), (slice(0, 1), slice(12, 13)), (slice(8, 10), slice(0, 13))):
            np.testing.assert_array_equal(store.read(name, region, progress), expected[region])


def test_packing_tells_which_records_are_damaged(store):
    entries = append(store, GRID.tiles_of(0))
    with (store.folder.path / entries[6].segment).open("r+b") as file:
        for tile in (6, 11):
            file.seek(entries[tile].offset + 2)
            file.write(b"\xfe")
    with pytest.raises(DamagedRecordsError) as error:
        pack(store, 0, entries.values())
    assert error.value.tiles == {6, 11}


def test_records_that_changed_places_are_not_packed_into_each_others_tiles(store):
    entries = append(store, GRID.tiles_of(0))
    first, second = entries[10], entries[11]  # as where segments of the same sizes are mixed up
    path = store.folder.path / first.segment
    content = path.read_bytes()
    a, b = slice(first.offset, first.offset + first.length), slice(second.offset, second.offset + second.length)
    assert second.offset == a.stop and first.length == second.length and content[a] != content[b]
    path.write_bytes(content[:a.start] + content[b] + content[a] + content[b.stop:])
    with pytest.raises(DamagedRecordsError) as caught:
        pack(store, 0, entries.values())
    assert caught.value.tiles == {10, 11}


def test_packing_again_gives_the_same_bytes(store):
    pack_all(store)
    before = {n: c for n, c in files(store.folder.path).items() if n.parts[0] != "run"}
    shutil.rmtree(store.folder.path / "run")
    pack_all(store)
    assert {n: c for n, c in files(store.folder.path).items() if n.parts[0] != "run"} == before


FILE = "v_rms/c/0/0"
"""The group file that is damaged. Its chunks have the tiles 0, 1, 5, 6 and 2, 3, 7, 8, and below 10, 11, 15, 16 and 12,
13, 17, 18."""


def flip(content, at):
    return content[:at] + bytes([content[at] ^ 1]) + content[at + 1:]


DAMAGE = {
    "a byte of the first chunk": (lambda c: flip(c, 5), {0, 1, 5, 6}),
    "a byte of the last chunk": (lambda c: flip(c, len(c) - 75), {12, 13, 17, 18}),
    "the index": (lambda c: flip(c, len(c) - 9), "all"), "cut short": (lambda c: c[:-1], "all"),
    "longer": (lambda c: c + b"0", "all"), "empty": (lambda c: b"", "all"), "missing": (None, "all"),
}


@pytest.mark.parametrize(("change", "lost"), DAMAGE.values(), ids=DAMAGE)
def test_what_is_intact_of_a_damaged_group_is_saved(store, change, lost):
    progress, group = pack_all(store), GRID.tiles_of(0)
    content = store.folder.read(FILE)
    store.folder.delete(FILE) if change is None else store.folder.write(FILE, change(content))
    seen = change is None or len(change(content)) != len(content)
    assert (missing_parts(store, progress).files, missing_parts(store, progress).groups) == (
        ([FILE], [0]) if seen else ([], []))
    lost = set(group) if lost == "all" else lost
    line, entries = unpack(store, 0, progress, SegmentWriter(store.folder, ARRAYS))
    assert line == Lost([], [0], 100.0) and {e.tile for e in entries} == set(group) - lost
    assert all(e.at > 100.0 and record_is_intact(store.folder, e) for e in entries)
    for found in (line, *entries):
        progress.add(found)
    assert set(progress.missing(range(GRID.count))) == lost
    for entry in append(store, lost).values():
        progress.add(TileEntry(**{**vars(entry), "at": 2e9}))
    assert progress.complete_groups() == [0]
    pack(store, 0, [progress.entries[t] for t in group])
    assert store.folder.read(FILE) == content


def test_a_file_of_another_group_is_damage(store):
    progress = pack_all(store)
    written = progress.packed[0]["label"]
    assert damaged_chunks(store, "label", 0, written) == set()
    other = write_group(store, 0, "label", VALUES["label"][GRID.group_region(0)][::-1].copy())
    assert other != written and damaged_chunks(store, "label", 0, written) == {(0, 0), (0, 1), (1, 0), (1, 1)}
    assert damaged_chunks(store, "label", 0, None) == set()


def test_missing_records_are_found_by_the_sizes_of_segments(store):
    entries = append(store, range(5))
    progress = progress_of(store, *entries.values())
    assert missing_parts(store, progress).records == []
    os.truncate(store.folder.path / entries[0].segment, entries[3].offset + 9)
    missing = missing_parts(store, progress)
    assert (missing.records, missing.files) == ([3, 4], [entries[0].segment]) and 2 not in missing.tiles
    store.folder.delete(entries[0].segment)
    assert missing_parts(store, progress).records == [0, 1, 2, 3, 4]
    progress.add(progress.loss([0, 1, 2, 3, 4], []))
    assert progress.done_count == 0


def test_what_is_missing_is_named_in_blocks(store):
    progress = progress_of(store, *append(store, set(range(25)) - {0, 1, 5, 6, 9, 12, 17, 24}).values())
    missing = missing_parts(store, progress)
    covered = np.zeros(GRID.shape, int)
    for rows, columns in missing.boxes(GRID):
        covered[slice(*rows), slice(*columns)] += 1
    expected = np.isin(np.arange(130).reshape(10, 13), np.concatenate([GRID.items(t) for t in missing.tiles]))
    np.testing.assert_array_equal(covered, expected)
    assert sorted(missing.boxes(GRID)) == [
        ((0, 4), (0, 6)), ((2, 4), (12, 13)), ((4, 8), (6, 9)), ((8, 10), (12, 13))]


def test_missing_tiles_of_a_row_are_named():
    assert MissingParts([0, 1, 4], [], [], [], []).boxes(Grid((300,), (64,))) == [((0, 128),), ((256, 300),)]


def test_a_slow_write_delays_no_other(store, monkeypatch):
    """All arrays of a group are written side by side: each write waits until the others have begun."""
    entries, meeting = append(store, GRID.tiles_of(0)), threading.Barrier(len(ARRAYS), timeout=20)
    true = LocalFolder.write

    def write(self, name, content):
        meeting.wait()
        true(self, name, content)

    monkeypatch.setattr(LocalFolder, "write", write)
    assert groups.pack(store, 0, entries.values()).keys() == ARRAYS.keys()

