"""The report of a run: a self-contained page with figures, claims and provenance, and the data in files beside it."""

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

from gearchaos.execute.pool import Pool
from gearchaos.execute.pools import thread_pool
from gearchaos.files import write_bytes
from gearchaos.flow import cancel_event
from gearchaos.paper import claims as claims_
from gearchaos.paper import settings
from gearchaos.paper.cache import ComputationCache
from gearchaos.paper.figures import draw
from gearchaos.paper.findings import findings
from gearchaos.paper.log import Log
from gearchaos.paper.output import save_data, writable_folder
from gearchaos.paper.page import FinishedFigure, ReportContents, render
from gearchaos.paper.proofs import prove_claims


def build(
    out_dir: str | os.PathLike[str], figures: Iterable[int] | None = None, quality: str = "paper", progress: bool = True
) -> int:
    """Reproduce the paper: compute its figures, check its claims, and write a report.

    Parameters
    ----------
    out_dir : path
        Folder for index.html, figNN.png, claims.json, data/ and certificates/; created if necessary.
    figures : iterable of int, optional
        Which figures, with the claims that belong to them; all if left out.
    quality : {"paper", "draft"}
        Resolution of maps, diagrams and portraits.
    progress : bool
        Report progress on stderr.

    Returns
    -------
    int
        0, or 1 if a statement that should hold is contradicted.

    Raises
    ------
    InputError
        For an unknown figure or quality, or a folder that cannot be written; before any work.
    """
    chosen, resolution = settings.chosen_figures(figures), settings.quality(quality)
    folder = writable_folder(out_dir)
    start, log = time.perf_counter(), Log(progress)
    done = _figures(ComputationCache(resolution, progress=progress), log, folder, chosen.values())
    claims = [claim for one in done for claim in one.checked.result().claims]
    claim_seconds = sum(one.checked.result().seconds for one in done)
    write_bytes(folder / "claims.json", _json([c.to_dict() for c in claims]))
    finished = [one.finished() for one in done]
    contents = ReportContents(finished, claims, resolution, claim_seconds, time.perf_counter() - start)
    write_bytes(folder / "index.html", render(contents).encode())
    return log.end(folder, claims, claims_.failed(claims))


@dataclass(frozen=True)
class _Computed:
    """A figure with its data and findings, and the seconds they took."""

    setting: settings.FigureSettings
    data: dict[str, xr.Dataset]
    found: list[str]
    dpi: int
    seconds: float


def _computed(cache: ComputationCache, log: Log, figures: Iterable[settings.FigureSettings]) -> Iterator[_Computed]:
    """Compute the figures one after another."""
    for figure in figures:
        log.figure(figure)
        start = time.perf_counter()
        data = cache.figure(figure)
        found = findings(cache, figure, data)
        yield _Computed(figure, data, found, cache.quality.dpi, time.perf_counter() - start)


@dataclass(frozen=True)
class _Checked:
    """The claims of a figure, and the seconds that their checks took."""

    claims: list[claims_.Claim]
    seconds: float


@dataclass(frozen=True)
class _FigureInProgress:
    """A computed figure, and what other threads make of it: picture and seconds of drawing, data files, claims."""

    computed: _Computed
    picture: Future[tuple[bytes, float]]
    files: Future[list[str]]
    checked: Future[_Checked]

    @property
    def parts(self) -> tuple[Future[Any], ...]:
        """All that is made in other threads."""
        return self.picture, self.files, self.checked

    def finished(self) -> FinishedFigure:
        """The figure with its picture and data files; waits until they are made."""
        png, seconds = self.picture.result()
        return FinishedFigure(
            self.computed.setting, png, self.computed.found, self.files.result(), self.computed.seconds, seconds
        )


def _figures(
    cache: ComputationCache, log: Log, folder: Path, figures: Iterable[settings.FigureSettings]
) -> list[_FigureInProgress]:
    """Compute every figure; draw it, save its data and check its claims while others are computed.

    An error in another thread is raised before the next figure is computed, not only at the end.
    """
    under_way = list[_FigureInProgress]()
    with _single_threads(3) as (drawing, saving, checking):
        for done in _computed(cache, log, figures):
            for part in (part for before in under_way for part in before.parts if part.done()):
                part.result()
            under_way.append(_FigureInProgress(
                done, drawing.submit(_draw, folder, done), saving.submit(_save, folder, done),
                checking.submit(_check, cache, folder, done.setting.number),
            ))
        log.finishing()
        parts = [part for one in under_way for part in one.parts]
        for part in wait(parts, return_when=FIRST_EXCEPTION).done:
            part.result()
    return under_way


@contextmanager
def _single_threads(count: int) -> Iterator[list[Pool]]:
    """Pools of one thread each, which execute their items in order; an error in the context cancels all of them."""
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
    """Draw one figure and write it; returns the picture and the seconds that this took."""
    start = time.perf_counter()
    png = draw(done.setting, done.data, done.dpi)
    write_bytes(folder / f"fig{done.setting.number:02d}.png", png)
    return png, time.perf_counter() - start


def _save(folder: Path, done: _Computed) -> list[str]:
    """Save the data of one figure; returns the names of the files."""
    number, files = done.setting.number, []
    for name, ds in done.data.items():
        files.append(f"data/fig{number:02d}{'' if len(name) == 1 else '_'}{name}.nc")
        save_data(ds, folder / files[-1])
    return files


def _check(cache: ComputationCache, folder: Path, number: int) -> _Checked:
    """Check the claims of one figure, and prove their periodic motions.

    The precision of python-flint belongs to the process: proofs are made in one thread at a time.
    """
    start = time.perf_counter()
    claims = prove_claims(claims_.check_all(cache, claims_.claims_of([number])), folder)
    return _Checked(claims, time.perf_counter() - start)


def _json(value: object) -> bytes:
    return (json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False) + "\n").encode()
