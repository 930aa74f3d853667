"""What maps need of a cluster: core hours, files and bytes, from measured rates."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from storage.children import gearchaos, run
from storage.lines import Line

MAPS = {"fast": ("2.0:3.0", "0.0:0.05"), "typical": ("0.2:3.0", "0.0:0.3"), "chaotic": ("0.6:0.8", "0.25:0.3")}
"""Ranges of omega and eps1, with q0 = 0.1: periodic motions alone, figure 2a, and four fifths chaos."""

SIDES = {"10^8": 10_000, "10^9": 31_623, "10^10": 100_000, "10^12": 1_000_000}
"""Columns and rows of the maps of the table."""

_SIDE, _STORED = 128, 512
"""Columns and rows of the maps whose computing time is measured, and of the one that is stored."""

_TIMED = """
import sys, time
import gearchaos as gc
def compute(side):
    axes = [gc.Axis(name, *map(float, text.split(":")), side) for name, text in zip(("omega", "eps1"), sys.argv[2:])]
    gc.zones(gc.MeshModel.of(q0=0.1), *axes, threads=1)
compute(8)
before = time.process_time()
compute(int(sys.argv[1]))
print(time.process_time() - before)
"""

@dataclass(frozen=True)
class Division:
    """How a map is divided into files; see `storage.division`."""

    cells: int
    tiles: int
    blocks: int
    files: int
    tile_bytes: int
    block_bytes: int


@dataclass(frozen=True)
class Rates:
    """What was measured.

    Attributes
    ----------
    seconds : dict of str to float
        Seconds of one core to compute a cell, by kind of map.
    store_seconds : float
        Seconds of one core to store a cell.
    bytes : float
        Bytes of the results of a cell in a store of the typical map.
    """

    seconds: dict[str, float]
    store_seconds: float
    bytes: float


def division(side: int) -> Division:
    """The division that a run would choose for a map of side x side cells."""
    command = [sys.executable, str(Path(__file__).with_name("division.py")), str(side)]
    return Division(**json.loads(run(command, True, {}).stdout))


def measured(folder: Path) -> Iterator[Line | Rates]:
    """Measure the rates: a line for each, and the rates at the end."""
    seconds = {}
    for name, ranges in MAPS.items():
        spent = float(run([sys.executable, "-c", _TIMED, str(_SIDE), *ranges], True, {}).stdout)
        seconds[name] = spent / _SIDE**2
        yield Line(f"{name} map: computing", f"{seconds[name] * 1e6:.0f} µs of CPU per cell")
    study, store = folder / "typical.toml", folder / "typical.zarr"
    study.write_text(_typical())
    main = "from gearchaos.cli import main; main()"
    run([sys.executable, "-c", main, "run", str(study), "--out", str(store)], True, {})
    size = _size(store, lambda path: "run" not in path.relative_to(store).parts) / _STORED**2
    yield Line("typical map: bytes", f"{size:.1f} per cell")
    instant = gearchaos("run", study, "--out", folder / "instant.zarr")
    few = gearchaos("run", _smaller(study), "--out", folder / "small.zarr")
    each = (instant.cpu - few.cpu) / _STORED**2
    yield Line("storing", f"{each * 1e6:.2f} µs of CPU per cell")
    yield Rates(seconds, each, size)


def _typical(side: int = _STORED) -> str:
    omega, eps1 = MAPS["typical"]
    return f'[model]\nq0 = 0.1\n[study]\nkind = "zones"\nx = "omega={omega}:{side}"\ny = "eps1={eps1}:{side}"\n'


def _smaller(study: Path) -> Path:
    """A study of few cells, whose run takes what every run takes."""
    path = study.with_name("small.toml")
    path.write_text(_typical(16))
    return path


def _size(folder: Path, chosen) -> int:
    return sum(os.path.getsize(path) for path in folder.rglob("*") if path.is_file() and chosen(path))


def cluster(folder: Path) -> Iterator[Line]:
    """The rates, and the table of what maps of 10^8 cells and more need."""
    rates = None
    for line in measured(folder):
        if isinstance(line, Line):
            yield line
        else:
            rates = line
    for name, side in SIDES.items():
        yield Line(f"{name} cells", row(division(side), rates))


def row(needed: Division, rates: Rates) -> str:
    """What a map needs, as text."""
    hours = {name: needed.cells * (each + rates.store_seconds) / 3600 for name, each in rates.seconds.items()}
    parts = [f"{name} {_number(each)}" for name, each in hours.items()]
    storing = needed.cells * rates.store_seconds / 3600
    return (
        f"core hours: {', '.join(parts)} (storing: {_number(storing)}); {needed.tiles:,} tiles, "
        f"{needed.blocks:,} blocks, {needed.files:,} files; results {_bytes(needed.cells * rates.bytes)}; a tile "
        f"{_bytes(needed.tile_bytes)}, a block {_bytes(needed.block_bytes)}")


def _number(value: float) -> str:
    return f"{value:,.0f}" if value >= 10 else f"{value:.2g}"


def _bytes(size: float) -> str:
    for unit in ("B", "kB", "MB", "GB", "TB"):
        if size < 1000 or unit == "TB":
            return f"{size:.3g} {unit}"
        size /= 1000
    raise AssertionError


def on_paper(folder: Path) -> Iterator[Line]:
    """Files and seconds of large stores by their blocks, from the rates of 250 blocks of one tile each, and of one of
    1024 x 1024 cells."""
    study, store = folder / "blocks.toml", folder / "blocks.zarr"
    study.write_text(_typical(64))
    gearchaos("run", study, "--out", store, "--tile", 16, INSTANT_BLOCK_BYTES=1600)
    blocks, empty = len(list((store / "run" / "blocks").iterdir())), gearchaos("info", folder, check=False)
    info = (gearchaos("info", store).cpu - empty.cpu) / blocks
    yield Line("info", f"{info * 1e3:.2f} ms of CPU for each of {blocks} blocks")
    block = json.loads(run([sys.executable, str(Path(__file__).with_name("one_block.py")), str(folder / "one.zarr")],
                           True, {}).stdout)
    write, verify = block["write"], block["verify"]
    yield Line("writing a block of 2^20 cells, 21 arrays", f"{write[0]:.2f} s, {write[1]:.2f} s of CPU, "
               f"{_bytes(block['bytes'])}")
    speed = block["bytes"] / verify[0]
    yield Line("verifying its checksums", f"{_bytes(speed)}/s, {_bytes(block['bytes'] / verify[1])} a second of CPU")
    for name, side in SIDES.items():
        found = division(side)
        needs = found.cells / 2**20 * write[1] / 3600
        text = (f"{found.files:,} files, {found.blocks:,} blocks, {found.tiles:,} tiles; info "
                f"{found.blocks * info:,.1f} s of CPU; writing blocks {needs:.2g} core hours; verifying "
                f"{_number(found.cells * 46 / speed)} s for 46 bytes a cell")
        yield Line(f"{name} cells", text, *(("< 100,000 files", found.files < 100_000) if name == "10^9" else ()))
