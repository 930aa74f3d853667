"""The report: figures, claims and provenance of one run in a single self-contained page, with data beside it."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Iterable
from pathlib import Path

import xarray as xr

from gearchaos.files import write_bytes
from gearchaos.paper import claims as claims_
from gearchaos.paper import settings
from gearchaos.paper.bench import Bench
from gearchaos.paper.figures import draw
from gearchaos.paper.findings import findings
from gearchaos.paper.log import Log
from gearchaos.paper.output import save_data, writable_folder
from gearchaos.paper.page import Drawn, Page, render


def build(
    out_dir: str | os.PathLike[str], figures: Iterable[int] | None = None, quality: str = "paper", progress: bool = True
) -> int:
    """Reproduce the paper: figures, claims, and the report that holds both.

    Parameters
    ----------
    out_dir : path
        Gets index.html, figNN.png, claims.json and data/; made if need be.
    figures : iterable of int, optional
        Which figures, with the claims that belong to them; all if left out.
    quality : {"paper", "draft"}
        How finely to compute.
    progress : bool
        Tell on stderr what is being done.

    Returns
    -------
    int
        0, or 1 if a statement that should hold is contradicted.

    Raises
    ------
    InputError
        For an unknown figure or quality, or a folder that cannot be written; before any work.
    """
    chosen, level = settings.chosen_figures(figures), settings.quality(quality)
    folder = writable_folder(out_dir)
    start, log = time.perf_counter(), Log(progress)
    bench = Bench(level, progress=progress)
    drawn = [_figure(bench, log, folder, figure) for figure in chosen.values()]
    drawing = time.perf_counter()
    judged = claims_.judge_all(bench, claims_.claims_of(chosen), log.claim)
    write_bytes(folder / "claims.json", _json([c.to_dict() for c in judged]))
    done = time.perf_counter()
    page = Page(drawn, judged, level, done - drawing, done - start)
    write_bytes(folder / "index.html", render(page).encode())
    return log.end(folder, judged, claims_.failed(judged))


def _figure(bench: Bench, log: Log, folder: Path, figure: settings.Figure) -> Drawn:
    """Compute, draw and write one figure with its data."""
    log.figure(figure)
    start = time.perf_counter()
    data = bench.figure(figure)
    found = findings(bench, figure, data)
    computed = time.perf_counter()
    png = draw(figure, data, bench.quality.dpi)
    done = time.perf_counter()
    write_bytes(folder / f"fig{figure.number:02d}.png", png)
    files = [_save(folder, figure.number, name, ds) for name, ds in data.items()]
    return Drawn(figure, png, found, files, computed - start, done - computed)


def _save(folder: Path, number: int, name: str, ds: xr.Dataset) -> str:
    file = f"data/fig{number:02d}{'' if len(name) == 1 else '_'}{name}.nc"
    save_data(ds, folder / file)
    return file


def _json(value: object) -> bytes:
    return (json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False) + "\n").encode()
