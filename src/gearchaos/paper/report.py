"""The report: figures, claims and provenance of one run in a single self-contained page, with data beside it."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Iterable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import dataclass
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
    with ThreadPoolExecutor(1) as pen:  # figures are drawn while others are computed
        drawing = _drawing(pen, folder, _computed(bench, log, chosen.values()))
        judging = time.perf_counter()
        judged = claims_.judge_all(bench, claims_.claims_of(chosen), log.claim)
        judged_in = time.perf_counter() - judging
        drawn = [figure.result() for figure in drawing]
    write_bytes(folder / "claims.json", _json([c.to_dict() for c in judged]))
    page = Page(drawn, judged, level, judged_in, time.perf_counter() - start)
    write_bytes(folder / "index.html", render(page).encode())
    return log.end(folder, judged, claims_.failed(judged))


@dataclass(frozen=True)
class _Computed:
    """A figure with its data and findings, and the seconds they took."""

    setting: settings.Figure
    data: dict[str, xr.Dataset]
    found: list[str]
    dpi: int
    seconds: float


def _computed(bench: Bench, log: Log, figures: Iterable[settings.Figure]) -> Iterator[_Computed]:
    """Compute the figures one after another."""
    for figure in figures:
        log.figure(figure)
        start = time.perf_counter()
        data = bench.figure(figure)
        found = findings(bench, figure, data)
        yield _Computed(figure, data, found, bench.quality.dpi, time.perf_counter() - start)


def _drawing(pen: Executor, folder: Path, figures: Iterable[_Computed]) -> list[Future[Drawn]]:
    """Hand every figure to the pen; raises what went wrong with one of those before it, not only at the end."""
    drawing = list[Future[Drawn]]()
    for done in figures:
        for figure in filter(Future.done, drawing):
            figure.result()
        drawing.append(pen.submit(_draw, folder, done))
    return drawing


def _draw(folder: Path, done: _Computed) -> Drawn:
    """Draw one figure and write it with its data."""
    number, start = done.setting.number, time.perf_counter()
    png = draw(done.setting, done.data, done.dpi)
    seconds = time.perf_counter() - start
    write_bytes(folder / f"fig{number:02d}.png", png)
    files = [_save(folder, number, name, ds) for name, ds in done.data.items()]
    return Drawn(done.setting, png, done.found, files, done.seconds, seconds)


def _save(folder: Path, number: int, name: str, ds: xr.Dataset) -> str:
    file = f"data/fig{number:02d}{'' if len(name) == 1 else '_'}{name}.nc"
    save_data(ds, folder / file)
    return file


def _json(value: object) -> bytes:
    return (json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False) + "\n").encode()
