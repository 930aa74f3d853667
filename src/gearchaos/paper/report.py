"""The report of a run: a self-contained page with figures, claims and provenance, and the data in files beside it."""

from __future__ import annotations

import json
import os
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import FIRST_EXCEPTION, Future, wait
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import xarray as xr
from rich.console import Console

from gearchaos.errors import InputError
from gearchaos.execute.pool import Pool
from gearchaos.execute.pools import thread_pool
from gearchaos.files import write_bytes
from gearchaos.flow import cancel_event
from gearchaos.paper import claims as claims_
from gearchaos.paper import settings
from gearchaos.paper.cache import ComputationCache
from gearchaos.paper.figures import draw, findings
from gearchaos.paper.page import FinishedFigure, proofs_in_words, render
from gearchaos.studies import save

_COMPRESSED_FROM = 1000
"""Variables with more values than these are compressed."""


def build(
    out_dir: str | os.PathLike[str], figures: Iterable[int] | None = None, quality: str = "paper", progress: bool = True
) -> int:
    """Reproduce the paper: compute its figures, check its claims, and write a report.

    The folder gets index.html, figNN.png, claims.json, data/ and certificates/; progress is reported on stderr. Only
    these ``figures`` are made, with the claims that belong to them; ``quality``, "paper" or "draft", sets the
    resolution. Returns 0, or 1 if a statement that should hold is contradicted. Raises `InputError` before any work.
    """
    chosen, resolution = settings.chosen_figures(figures), settings.quality(quality)
    folder = writable_folder(out_dir)
    start, console = time.perf_counter(), Console(stderr=True, quiet=not progress, highlight=False)
    cache = ComputationCache(resolution, progress=progress)
    done, claims, check_seconds = _figures(cache, console, folder, chosen.values())
    text = json.dumps([c.to_dict() for c in claims], indent=2, ensure_ascii=False, allow_nan=False)
    write_bytes(folder / "claims.json", f"{text}\n".encode())
    page = render(done, claims, resolution, check_seconds, time.perf_counter() - start)
    write_bytes(folder / "index.html", page.encode())
    tally = ", ".join(f"{count} {verdict}" for verdict, count in Counter(c.verdict for c in claims).items())
    console.print(f"{len(claims)} statements checked: {tally or 'none'}.")
    if proved := proofs_in_words(claims):
        console.print(proved, markup=False)
    for claim in claims_.failed(claims):
        console.print(f"[bold red]{claim.id}: {claim.verdict}[/bold red]  {claim.statement}")
    console.print(f"Report: {folder / 'index.html'}")
    return 1 if claims_.failed(claims) else 0


def writable_folder(path: str | os.PathLike[str]) -> Path:
    """The folder, created if necessary; raises an `InputError` if files cannot be written in it."""
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError as error:
        rule = "must be a folder that files can be written in"
        raise InputError("out", rule, str(path), f"{error.strerror}.") from None


def _figures(
    cache: ComputationCache, console: Console, folder: Path, figures: Iterable[settings.FigureSettings]
) -> tuple[list[FinishedFigure], list[claims_.Claim], float]:
    """Compute every figure; draw it, save its data and check its claims while others are computed.

    Returns the figures, their claims, and the seconds that the checks took. An error in another thread is raised before
    the next figure is computed, not only at the end.
    """
    under_way: list[tuple[settings.FigureSettings, list[str], float, tuple[Future[Any], ...]]] = []
    with _single_threads(3) as (drawing, saving, checking):
        for setting in figures:
            for part in (part for *_, parts in under_way for part in parts if part.done()):
                part.result()
            console.print(f"[bold]Figure {setting.number}[/bold]  {setting.title}")
            start = time.perf_counter()
            data = cache.figure(setting)
            found = findings(cache, setting, data)
            under_way.append((setting, found, time.perf_counter() - start, (
                drawing.submit(_draw, folder, setting, data, cache.quality.dpi),
                saving.submit(_save, folder, setting.number, data),
                checking.submit(_check, cache, folder, setting.number),
            )))
        console.print("[bold]Last statements and drawings[/bold]")
        for part in wait([part for *_, parts in under_way for part in parts], return_when=FIRST_EXCEPTION).done:
            part.result()
    finished, claims, check_seconds = [], list[claims_.Claim](), 0.0
    for setting, found, seconds, parts in under_way:
        (png, draw_seconds), files, (checked, took) = (part.result() for part in parts)
        finished.append(FinishedFigure(setting, png, found, files, seconds, draw_seconds))
        claims += checked
        check_seconds += took
    return finished, claims, check_seconds


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


def _draw(
    folder: Path, setting: settings.FigureSettings, data: Mapping[str, xr.Dataset], dpi: int
) -> tuple[bytes, float]:
    """Draw one figure and write it; returns the picture and the seconds that this took."""
    start = time.perf_counter()
    png = draw(setting, data, dpi)
    write_bytes(folder / f"fig{setting.number:02d}.png", png)
    return png, time.perf_counter() - start


def _save(folder: Path, number: int, data: Mapping[str, xr.Dataset]) -> list[str]:
    """Save the data of one figure, compressed, each file whole or not at all; returns the names of the files."""
    files = []
    for name, ds in data.items():
        files.append(f"data/fig{number:02d}{'' if len(name) == 1 else '_'}{name}.nc")
        packed = ds.copy()
        for variable in packed.variables.values():
            if variable.size > _COMPRESSED_FROM:
                variable.encoding = {"zlib": True, "complevel": 4, "shuffle": True}
        (folder / "data").mkdir(exist_ok=True)
        save(packed, folder / files[-1])
    return files


def _check(cache: ComputationCache, folder: Path, number: int) -> tuple[list[claims_.Claim], float]:
    """Check the claims of one figure, and prove their periodic motions; also the seconds that this took.

    The precision of python-flint belongs to the process: proofs are made in one thread at a time.
    """
    start = time.perf_counter()
    claims = claims_.prove_claims(claims_.check_all(cache, claims_.claims_of([number])), folder)
    return claims, time.perf_counter() - start
