"""The report: figures, claims and provenance of one run in a single self-contained page, with data beside it."""

from __future__ import annotations

import json
import os
import threading
import time
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_EXCEPTION, Future, wait
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import xarray as xr

from gearchaos.execute.pools import Pool, thread_pool
from gearchaos.files import write_bytes
from gearchaos.flow import cancel_event
from gearchaos.paper import claims as claims_
from gearchaos.paper import settings
from gearchaos.paper.cache import ComputationCache
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
    done = _figures(ComputationCache(level, progress=progress), log, folder, chosen.values())
    judged = [claim for one in done for claim in one.judged.result().claims]
    judged_in = sum(one.judged.result().seconds for one in done)
    write_bytes(folder / "claims.json", _json([c.to_dict() for c in judged]))
    page = Page([one.drawn() for one in done], judged, level, judged_in, time.perf_counter() - start)
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


def _computed(cache: ComputationCache, log: Log, figures: Iterable[settings.Figure]) -> Iterator[_Computed]:
    """Compute the figures one after another."""
    for figure in figures:
        log.figure(figure)
        start = time.perf_counter()
        data = cache.figure(figure)
        found = findings(cache, figure, data)
        yield _Computed(figure, data, found, cache.quality.dpi, time.perf_counter() - start)


@dataclass(frozen=True)
class _Judged:
    """The statements about a figure, judged, and the seconds that took."""

    claims: list[claims_.Claim]
    seconds: float


@dataclass(frozen=True)
class _UnderWay:
    """A computed figure: its picture with the seconds that drawing took, its data files and its statements to come."""

    computed: _Computed
    picture: Future[tuple[bytes, float]]
    files: Future[list[str]]
    judged: Future[_Judged]

    @property
    def parts(self) -> tuple[Future[Any], ...]:
        return self.picture, self.files, self.judged

    def drawn(self) -> Drawn:
        png, seconds = self.picture.result()
        return Drawn(
            self.computed.setting, png, self.computed.found, self.files.result(), self.computed.seconds, seconds
        )


def _figures(cache: ComputationCache, log: Log, folder: Path, figures: Iterable[settings.Figure]) -> list[_UnderWay]:
    """Every figure computed, and drawn, saved and judged while others are computed.

    Raises what went wrong with one of them before the next, not only at the end.
    """
    under_way = list[_UnderWay]()
    with _single_threads(3) as (drawing, saving, judging):
        for done in _computed(cache, log, figures):
            for part in (part for before in under_way for part in before.parts if part.done()):
                part.result()
            under_way.append(_UnderWay(
                done, drawing.submit(_draw, folder, done), saving.submit(_save, folder, done),
                judging.submit(_judge, cache, done.setting.number),
            ))
        log.finishing()
        parts = [part for one in under_way for part in one.parts]
        for part in wait(parts, return_when=FIRST_EXCEPTION).done:
            part.result()
    return under_way


@contextmanager
def _single_threads(count: int) -> Iterator[list[Pool]]:
    """Pools of one thread each, which work through their items in order; an error in the context cancels all."""
    cancelled = threading.Event()
    with ExitStack() as stack:
        pools = [stack.enter_context(thread_pool(1)()) for _ in range(count)]
        token = cancel_event.set(cancelled)
        try:
            yield pools
        except BaseException:
            cancelled.set()
            for pool in pools:
                pool.cancel()
            raise
        finally:
            cancel_event.reset(token)


def _draw(folder: Path, done: _Computed) -> tuple[bytes, float]:
    """Draw one figure and write it; the picture and the seconds it took."""
    start = time.perf_counter()
    png = draw(done.setting, done.data, done.dpi)
    write_bytes(folder / f"fig{done.setting.number:02d}.png", png)
    return png, time.perf_counter() - start


def _save(folder: Path, done: _Computed) -> list[str]:
    """Save the data of one figure; the names of the files."""
    number, files = done.setting.number, []
    for name, ds in done.data.items():
        files.append(f"data/fig{number:02d}{'' if len(name) == 1 else '_'}{name}.nc")
        save_data(ds, folder / files[-1])
    return files


def _judge(cache: ComputationCache, number: int) -> _Judged:
    """Judge the statements about one figure."""
    start = time.perf_counter()
    judged = claims_.judge_all(cache, claims_.claims_of([number]))
    return _Judged(judged, time.perf_counter() - start)


def _json(value: object) -> bytes:
    return (json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False) + "\n").encode()
