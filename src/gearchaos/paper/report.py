"""The report of a run: a self-contained page with figures, claims and provenance, and the data in files beside it."""

from __future__ import annotations

import json
import os
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_EXCEPTION, Future, wait
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
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
from gearchaos.paper.figures import draw
from gearchaos.paper.findings import findings
from gearchaos.paper.page import FinishedFigure, ReportContents, render
from gearchaos.paper.proofs import prove_claims, summary
from gearchaos.studies import save

_COMPRESSED_FROM = 1000
"""Variables with more values than these are compressed."""


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
    start, console = time.perf_counter(), Console(stderr=True, quiet=not progress, highlight=False)
    done = _figures(ComputationCache(resolution, progress=progress), console, folder, chosen.values())
    checked = [one.checked.result() for one in done]
    claims = [claim for one in checked for claim in one.claims]
    text = json.dumps([c.to_dict() for c in claims], indent=2, ensure_ascii=False, allow_nan=False)
    write_bytes(folder / "claims.json", f"{text}\n".encode())
    contents = ReportContents(
        [one.finished() for one in done], claims, resolution, sum(one.seconds for one in checked),
        time.perf_counter() - start,
    )
    write_bytes(folder / "index.html", render(contents).encode())
    _print_outcome(console, folder, claims)
    return 1 if claims_.failed(claims) else 0


def writable_folder(path: str | os.PathLike[str]) -> Path:
    """The folder, created if necessary; raises an `InputError` if files cannot be written in it."""
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError as error:
        raise InputError(
            "out", "must be a folder that files can be written in", str(path), f"{error.strerror}."
        ) from None


@dataclass(frozen=True)
class _Checked:
    """The claims of a figure, and the seconds that their checks took."""

    claims: list[claims_.Claim]
    seconds: float


@dataclass(frozen=True)
class _FigureInProgress:
    """A computed figure, and what other threads make of it: picture and seconds of drawing, data files, claims."""

    setting: settings.FigureSettings
    found: list[str]
    seconds: float
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
        return FinishedFigure(self.setting, png, self.found, self.files.result(), self.seconds, seconds)


def _figures(
    cache: ComputationCache, console: Console, folder: Path, figures: Iterable[settings.FigureSettings]
) -> list[_FigureInProgress]:
    """Compute every figure; draw it, save its data and check its claims while others are computed.

    An error in another thread is raised before the next figure is computed, not only at the end.
    """
    under_way = list[_FigureInProgress]()
    with _single_threads(3) as (drawing, saving, checking):
        for setting in figures:
            for part in (part for before in under_way for part in before.parts if part.done()):
                part.result()
            console.print(f"[bold]Figure {setting.number}[/bold]  {setting.title}")
            start = time.perf_counter()
            data = cache.figure(setting)
            found = findings(cache, setting, data)
            under_way.append(_FigureInProgress(
                setting, found, time.perf_counter() - start,
                drawing.submit(_draw, folder, setting, data, cache.quality.dpi),
                saving.submit(_save, folder, setting.number, data),
                checking.submit(_check, cache, folder, setting.number),
            ))
        console.print("[bold]Last statements and drawings[/bold]")
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


def _check(cache: ComputationCache, folder: Path, number: int) -> _Checked:
    """Check the claims of one figure, and prove their periodic motions.

    The precision of python-flint belongs to the process: proofs are made in one thread at a time.
    """
    start = time.perf_counter()
    claims = prove_claims(claims_.check_all(cache, claims_.claims_of([number])), folder)
    return _Checked(claims, time.perf_counter() - start)


def _print_outcome(console: Console, folder: Path, claims: Sequence[claims_.Claim]) -> None:
    """How many claims have each verdict, which failed, and the path of the report."""
    tally = ", ".join(f"{count} {verdict}" for verdict, count in Counter(c.verdict for c in claims).items())
    console.print(f"{len(claims)} statements checked: {tally or 'none'}.")
    if proved := summary(claims):
        console.print(proved, markup=False)
    for claim in claims_.failed(claims):
        console.print(f"[bold red]{claim.id}: {claim.verdict}[/bold red]  {claim.statement}")
    console.print(f"Report: {folder / 'index.html'}")
