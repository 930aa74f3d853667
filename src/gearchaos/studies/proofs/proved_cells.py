"""Proofs of the periodic motions in the cells of a map."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.dynamics import Verdicts
from gearchaos.dynamics.orbits import sections
from gearchaos.errors import InputError
from gearchaos.execute import tiles
from gearchaos.model import MeshModel
from gearchaos.proof.batch import OrbitToProve, prove_in_process
from gearchaos.proof.certificate import INFERRED, NO_REASON, REASON_CODES, Proved
from gearchaos.studies.core.initial_value_problems import Motions
from gearchaos.studies.proofs.proofs import write_verifier

if TYPE_CHECKING:
    import xarray as xr

_BATCH = 1000  # most orbits that are proved by one process: some seconds of work, to which its start adds a few percent

Found = dict[str, np.ndarray]


def orbit_points(motions: Motions, found: Verdicts) -> Found:
    """The states (n, d) at τ = k T of the periodic orbits among the verdicts (L,), as ``orbit``, (L,) of object.

    They are those to which Newton's method converged for the verdict. Other motions have None.
    """
    out = np.full(len(found.period), None, dtype=object)
    periodic = np.flatnonzero(found.period > 0)
    if len(periodic):
        states = sections(motions.flow, found.w[:, periodic].copy(), motions.points[periodic], found.period[periodic])
        for motion, orbit in zip(periodic, states, strict=True):
            out[motion] = orbit
    return {"orbit": out}


def proofs(
    models: Sequence[MeshModel | None], orbits: np.ndarray, files: Sequence[str | None], *,
    progress: bool = False, threads: int | None = None,
) -> Found:
    """Prove orbits in parallel processes, by default one per core.

    There are N models, None where there is no orbit; the states (n, d) of each orbit as `orbit_points` gives them; and
    the files for the certificates. Gives ``proved`` and ``proof_reason``, (N,) of int8, for any number of processes.
    """
    codes = np.full((len(orbits), 2), (Proved.NOT_PERIODIC, NO_REASON), dtype=np.int8)
    chosen = np.array([i for i, orbit in enumerate(orbits) if orbit is not None], dtype=int)
    period = np.array([len(orbits[i]) for i in chosen], dtype=int)
    chosen = chosen[np.argsort(-period, kind="stable")]
    chosen = chosen[tiles.interleaved(len(chosen), threads)]  # long ones are spread evenly over the batches
    wanted = [OrbitToProve(models[i], orbits[i], files[i]) for i in chosen]
    batches = tiles.split(len(chosen), _BATCH, threads) if len(chosen) else []
    for batch, found in tiles.run(
        lambda batch: prove_in_process(wanted[batch]), batches, progress="proofs" if progress else None,
        threads=threads,
    ):
        codes[chosen[batch]] = found
    return {"proved": codes[:, 0], "proof_reason": codes[:, 1]}


def mark_inferred(found: Found) -> None:
    """Mark the periodic motions of inferred cells as not proved."""
    periodic = (found["inferred"] == 1) & (found["period"] > 0)
    found["proved"][periodic], found["proof_reason"][periodic] = Proved.NOT_PROVED, INFERRED


def certificate_files(folder: str | None, cells: np.ndarray, columns: int) -> list[str | None]:
    """The paths of the certificates of cells (N,): one folder for each row of the map, one file for each column.

    The folders are created, and the script that verifies certificates is copied beside them. Certificates that an
    earlier map left for these cells are removed.
    """
    if folder is None:
        return [None] * len(cells)
    target, places = Path(folder), [divmod(int(cell), columns) for cell in cells]
    for row in {row for row, _ in places}:
        (target / f"row{row:04d}").mkdir(parents=True, exist_ok=True)
    write_verifier(target / "verifier.py")
    files = [target / f"row{row:04d}" / f"column{column:04d}.json" for row, column in places]
    for file in files:
        file.unlink(missing_ok=True)
    return list(map(str, files))


def check_folder(certificates: str | None, prove: bool) -> None:
    """Raise `InputError` unless certificates can be written to this folder; before any work."""
    if certificates is None:
        return
    if not isinstance(certificates, str):
        raise InputError("certificates", "must be a text, the path of a folder", certificates)
    if not prove:
        raise InputError("certificates", "needs prove = true", certificates)
    path = Path(certificates)
    if path.exists() and not path.is_dir():
        raise InputError("certificates", "must be a folder", certificates)


def proof_counts(parts: Iterable[xr.Dataset]) -> dict[str, Any]:
    """How many cells of a map, given in one or several parts, are proved, as JSON-ready values.

    ``periodic`` is the number of cells with a periodic motion, ``proved`` that of those that are proved, ``share`` the
    quotient, None if there are none, and ``unproved`` the numbers of the others by reason.
    """
    totals = {"proved": Counter[int](), "proof_reason": Counter[int]()}
    for part in parts:
        for name, total in totals.items():
            codes, numbers = np.unique(part[name].values, return_counts=True)
            total.update(dict(zip(codes.tolist(), numbers.tolist(), strict=True)))
    proved, reasons = totals.values()
    periodic, count = proved.total() - proved[Proved.NOT_PERIODIC], proved[Proved.PROVED]
    return {"periodic": periodic, "proved": count, "share": count / periodic if periodic else None,
            "unproved": {name: reasons[code] for code, name in REASON_CODES.items()
                         if code != NO_REASON and reasons[code]}}


def proof_counts_in_words(counts: dict[str, Any]) -> str:
    """The result of `proof_counts` in a line."""
    share = "" if counts["share"] is None else f" ({100 * counts['share']:.2f} %)"
    rest = "".join(f"; {n} not: {name}" for name, n in counts["unproved"].items())
    return f"proved {counts['proved']} of {counts['periodic']} periodic cells{share}{rest}"
