"""How a store grows with its tiles: files, `info`, resuming, `export`, finishing; and with its cells."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

from storage.children import Spent, gearchaos
from storage.lines import Line
from storage.needs import division

TILES = {1000: (160, 100), 10_000: (400, 400), 100_000: (1600, 1000)}
"""Columns and rows of a map that has this number of tiles of 16 cells."""

STUDY = """
[model]
q0 = 0.1
[study]
kind = "zones"
x = "omega=0.5:1.1:{}"
y = "eps1=0.05:0.3:{}"
"""


def write_study(folder: Path, columns: int, rows: int) -> Path:
    """A study file of a map of zones."""
    path = folder / f"map_{columns}x{rows}.toml"
    path.write_text(STUDY.format(columns, rows))
    return path


def files(folder: Path) -> tuple[int, int]:
    """Number and total bytes of the files below a folder."""
    sizes = [os.path.getsize(Path(at) / name) for at, _, names in os.walk(folder) for name in names]
    return len(sizes), sum(sizes)


def tiles(folder: Path, count: int) -> Iterator[Line]:
    """The store of a map of this many tiles of 16 cells."""
    study, store, large = write_study(folder, *TILES[count]), folder / f"{count}.zarr", count == 100_000
    arguments = ("run", study, "--out", store, "--tile", 16)
    name = f"{count:,} tiles"
    computed = gearchaos(*arguments)
    yield Line(f"{name}: run", f"{computed}, {count / computed.wall:.0f} tiles/s")
    found, size = files(store)
    yield Line(f"{name}: files", f"{found:,}, {size:,} bytes", *_goal(large, "<= 400", found <= 400))
    yield Line(f"{name}: info", str(info := gearchaos("info", store)), *_goal(large, "<= 15 s", info.wall <= 15))
    resumed = gearchaos(*arguments)
    yield Line(f"{name}: resume when finished", str(resumed), *_goal(large, "<= 15 s", resumed.wall <= 15))
    finished = _finish_again(store, arguments)
    yield Line(f"{name}: resume and finish", str(finished), *_goal(large, "<= 400 MB", finished.peak <= 4e8))
    exported = gearchaos("export", store, "--out", folder / f"{count}.nc")
    size = os.path.getsize(folder / f"{count}.nc")
    yield Line(
        f"{name}: export", f"{exported}, {size:,} bytes", *_goal(count == 10_000, "< 30 s", exported.wall < 30))
    shutil.rmtree(store)


def _goal(applies: bool, goal: str, reached: bool) -> tuple[str, bool | None]:
    return (goal, reached) if applies else ("", None)


def _finish_again(store: Path, arguments: tuple[object, ...]) -> Spent:
    """Finish a finished store once more, as when the process was killed just before the end."""
    (store / "run" / "finished").unlink()
    return gearchaos(*arguments)


def begin_large(folder: Path, side: int = 31_623, after: int = 20) -> Iterator[Line]:
    """A map, of 10^9 cells by default: the time until its first tile is computed, and memory, until it is stopped."""
    study, store, log = write_study(folder, side, side), folder / "large.zarr", folder / "large.log"
    spent = gearchaos("run", study, "--out", store, check=False, INSTANT_LOG=log, INSTANT_STOP=after)
    if not log.exists():
        yield Line(f"{side} x {side} cells: begin", f"exit code {spent.code}: {spent.stderr.splitlines()[-1][:150]}")
        return
    times = [float(line.split()[0]) - spent.started for line in log.read_text().splitlines()]
    text = f"first tile after {times[0]:.1f} s; {len(times)} tiles in {spent}"
    reached = times[0] <= 5 and spent.peak <= 4e8
    yield Line(f"{side} x {side} cells: begin", text, "<= 5 s, 400 MB", reached)
    again = gearchaos("run", study, "--out", store, check=False, INSTANT_LOG=log, INSTANT_STOP=1)
    yield Line(f"{side} x {side} cells: begin again", str(again), "<= 400 MB", again.peak <= 4e8)
    yield Line(f"{side} x {side} cells: info", str(gearchaos("info", store)))
    shutil.rmtree(store)


def full_store(folder: Path, side: int = 3163) -> Iterator[Line]:
    """A store of 10^7 cells with default tiles: files, memory, `check`, `export` and `plot`."""
    study, store, cells = write_study(folder, side, side), folder / "full.zarr", side * side
    spent = gearchaos("run", study, "--out", store)
    yield Line("10^7 cells: run", f"{spent}, {spent.cpu / cells * 1e6:.2f} µs of CPU per cell")
    found = files(store)
    expected = division(side).files
    yield Line("10^7 cells: files", "{:,}, {:,} bytes".format(*found), f"{expected:,} by its grid",
               abs(found[0] - expected) <= 0.1 * expected)
    info = json.loads(gearchaos("info", store, "--json").stdout)
    yield Line("10^7 cells: info", f"finished: {info['finished']}, {info['tiles_done']} tiles")
    checked = gearchaos("check", store, check=False)
    rate = f"{cells / checked.wall / 1e6:.1f} million cells/s, {found[1] / checked.wall / 1e6:.0f} MB/s, {checked}"
    yield Line("10^7 cells: check", rate if checked.code == 0 else f"exit code {checked.code}: {checked.stderr[-200:]}")
    for name, target in (("export", "full.nc"), ("plot", "full.png")):
        exported = gearchaos(name, store, "--out", folder / target)
        yield Line(f"10^7 cells: {name}", str(exported), "< 1 GB", exported.peak < 1e9)
    shutil.rmtree(store)
