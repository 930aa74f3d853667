"""The skeleton of a map: all curves of events of periodic orbits in a window of two parameters.

Its journal is a text file with the lines and curves that are finished, one per line. The store cannot take its place:
which curves there are follows from the lines, and whether an event gives another curve from the curves found before.
"""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Mapping, Sequence
from concurrent.futures import BrokenExecutor
from dataclasses import dataclass, fields
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from gearchaos.continuation.curve import CurveData
from gearchaos.continuation.defining import EventSeed
from gearchaos.continuation.skeleton import CurveSearch, find_curves
from gearchaos.datasets import new_dataset, provenance, variables
from gearchaos.errors import InputError, whole_number
from gearchaos.execute.machine import cores
from gearchaos.execute.pool import OTHER_CALL, RESUME_ADVICE
from gearchaos.execute.pools import process_pool, thread_pool
from gearchaos.studies.core.axis import Axis
from gearchaos.studies.core.declaration import function_of
from gearchaos.studies.core.options import Option, axis_option, option
from gearchaos.studies.core.study import PROGRESS, WholeStudy
from gearchaos.studies.orbits.curve import curve_ends, point_variables, special_variables
from gearchaos.studies.orbits.following import parameter_plane

if TYPE_CHECKING:
    import xarray as xr


_MOST_LINES = 1000


@dataclass(frozen=True)
class Skeleton(WholeStudy):
    """Find all curves of events in a window of two parameters.

    The events are folds, flips, Neimark-Sacker bifurcations and grazes. Stable motions are searched on lines parallel
    to both axes, and the branches of their orbits are followed along the lines, with the branches of doubled periods.
    Every event on them that lies on no known curve gives another curve.

    Returns
    -------
    xarray.Dataset
        Over ``point``, the points of all curves one after another: both parameters as coordinates, ``curve``, the
        number of the curve, and variables as those of `curve`; ``section_<coordinate>`` is NaN after the last point of
        an orbit. Over ``curve``: ``curve_kind``, ``curve_period``, ``curve_boundary`` (1 or −1 for a graze, otherwise
        0) and ``curve_closed``. Over ``special``, the points of codimension 2: ``special_kind``, both parameters and
        ``special_curve``. The attributes ``ends`` (of each curve) and ``failed`` (numbers of events whose curve could
        not be followed, by reason) are JSON.

    Raises
    ------
    InputError
        If an argument is out of range, or the journal is one of another skeleton.
    OSError
        If a worker process dies, or the journal cannot be written.

    Notes
    -----
    A curve is found if a branch through a stable motion on one of the lines meets it, or if another of its events does;
    more lines, places and starts find more. The result does not depend on the number of workers. Processes are started
    by importing the main module anew, so that a script must call this under ``if __name__ == "__main__":``.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(q0=0.1)
    >>> curves = gc.skeleton(
    ...     model, "omega=1.7:2.3:8", "eps1=0.03:0.09:4", period=1, lines=(1, 1), starts=0, workers=1)
    >>> curves.curve_kind.values.tolist()
    ['flip', 'flip']

    As a value
    ----------
    >>> import gearchaos as gc
    >>> gc.Skeleton(gc.MeshModel.of(q0=0.1), "omega=1.7:2.3", "eps1=0.03:0.09:4").x.count
    48
    """

    kind: ClassVar[str] = "skeleton"
    rank: ClassVar[int] = 9
    group: ClassVar[str] = "Bifurcations"
    needs_out: ClassVar[bool] = True
    summary: ClassVar[str] = "skeleton"
    run_options: ClassVar[tuple[Option, ...]] = (
        Option("journal", "str | PathLike[str] | None", None, "A file that keeps finished work. If it exists, the same "
               "call goes on from there.", type=Path),
        PROGRESS,
        Option("workers", "int | None", None, "Processes, by default one per core. With 1 all is computed in this "
               "process.", type=int))

    x: Axis = axis_option(
        'A parameter and its range, "omega=0.2:2.5:48". The number of values is that of the places at which motions '
        "are searched on a line; 48 if left out.", 48)
    y: Axis = axis_option("Another one; its number of values is 24 if left out.", 24)
    period: int = option(4, "Largest period of the orbits. It counts mesh periods.", least=1, most=64)
    lines: tuple[int, int] = option((8, 5), "Numbers of lines along x and along y on which events are searched.")
    starts: int = option(3, "Initial states at each place, besides the model's own.", least=0, most=10_000)

    def __post_init__(self) -> None:
        super().__post_init__()
        lines = self.lines
        if not isinstance(lines, Sequence) or len(lines) != 2:
            raise InputError("lines", "must be two numbers: of lines along x and along y", lines, "E.g. (8, 5).")
        along_x, along_y = (whole_number("lines", number, 0, _MOST_LINES) for number in lines)
        if along_x == along_y == 0:
            raise InputError("lines", "must have at least one line along x or y", lines, "E.g. (8, 5).")
        self._set(lines=(along_x, along_y))
        parameter_plane(self.model, self.x, self.y)

    def dataset(
        self, *, progress: bool = False, threads: int | None = None, workers: int | None = None,
        journal: str | PathLike[str] | None = None,
    ) -> xr.Dataset:
        x, y, count = self.x, self.y, cores() if workers is None else whole_number("workers", workers, 1)
        family = parameter_plane(self.model, x, y)
        search = CurveSearch(self.period, self.lines, (x.count, y.count), self.starts)
        attributes = provenance(
            self.kind, family.model, x=[x.name, x.start, x.stop, x.count], y=[y.name, y.start, y.stop, y.count],
            period=self.period, lines=list(self.lines), starts=self.starts)
        kept = None if journal is None else SkeletonJournal(Path(journal), attributes)
        pool = thread_pool(threads or 1) if threads or count == 1 else process_pool(count)
        bounds = ((x.start, x.stop), (y.start, y.stop))
        try:
            with pool() as running:
                curves, failed = find_curves(
                    family.model, (x.name, y.name), bounds, running, search, journal=kept, progress=progress)
        except BrokenExecutor:
            advice = "" if kept is None else RESUME_ADVICE
            raise OSError("a worker process died. A script must call skeleton under if __name__ == '__main__':, or "
                          f"with workers=1. {advice}".rstrip()) from None
        points, coordinates = point_variables(family, curves)
        number = np.arange(len(curves))
        data = {
            **variables(("point",), {"curve": np.repeat(number, [len(c.values) for c in curves]).astype(int)}),
            **points,
            **variables(("number",), {
                "curve_kind": np.array([c.kind for c in curves], dtype=object),
                "curve_period": np.array([c.period for c in curves], int),
                "curve_boundary": np.array([c.boundary or 0 for c in curves], int),
                "curve_closed": np.array([c.closed for c in curves], bool)}),
            **special_variables(family, curves),
            **variables(("special",), {
                "special_curve": np.repeat(number, [len(c.special) for c in curves]).astype(int)}),
        }
        ends = [{"curve": i, **end} for i, c in enumerate(curves) for end in curve_ends(family, c)]
        return new_dataset(data, coordinates, {
            **attributes, "failed": json.dumps(Counter(why for _, why in failed)), "ends": json.dumps(ends)})


skeleton = function_of(Skeleton)


_ARRAYS = ("points", "values", "residual", "angle")  # fields that are arrays of real numbers


class SkeletonJournal(dict[str, Any]):
    """Finished work by name, kept in a file; see `gearchaos.continuation.skeleton.Journal`.

    The file is JSON, one document per line: first the settings, on which all results depend, then a name and its result
    each. An item is appended when it is set. A line that was not written to its end is removed when the file is opened
    again. Raises `InputError` if the file has other settings, is no journal, or cannot be written.
    """

    def __init__(self, path: Path, settings: Mapping[str, Any]) -> None:
        super().__init__()
        self._path = path
        try:
            content = path.read_bytes() if path.exists() else b""
            complete = content[: content.rfind(b"\n") + 1]
            path.touch()
            os.truncate(path, len(complete))
        except OSError as error:
            raise InputError("journal", "must be a file that can be written", str(path), f"{error.strerror}.") from None
        own = json.loads(json.dumps(dict(settings)))
        if not complete:
            self._write(own)
            return
        try:
            first, *documents = (json.loads(line) for line in complete.splitlines())
            found = {name: _decoded(value) for name, value in documents} if first == own else {}
        except (AttributeError, KeyError, TypeError, ValueError):
            raise InputError("journal", "must be a journal of a skeleton, whole and readable", str(path),
                             "Delete it, or choose another file.") from None
        if first != own:
            raise InputError("journal", "must be one of the same model, axes, settings and versions", str(path),
                             OTHER_CALL)
        self.update(found)

    def _write(self, document: Any) -> None:
        """Append one document as a line: arrays as real and imaginary parts in turn, events and curves as fields."""
        def plain(value: Any) -> Any:
            if isinstance(value, np.ndarray):
                return value.view(float).tolist()
            return {f.name: getattr(value, f.name) for f in fields(value)}

        with self._path.open("ab") as file:
            file.write(json.dumps(document, default=plain).encode() + b"\n")

    def __setitem__(self, name: str, value: Any) -> None:
        super().__setitem__(name, value)
        self._write([name, {"why": value} if isinstance(value, str) else value])


def _decoded(value: Any) -> Any:
    """The result of a line or a curve from JSON."""
    if isinstance(value, list):
        return [_decoded(seed) for seed in value]
    if "why" in value:
        return value["why"]
    out: dict[str, Any] = {
        name: np.array(v, float) if name in _ARRAYS and isinstance(v, list) else v for name, v in value.items()}
    if "multipliers" not in out:
        return EventSeed(**out)
    out["multipliers"] = np.array(out["multipliers"], float).view(complex)
    out["special"] = [(kind, np.array(values)) for kind, values in out["special"]]
    out["ends"] = [tuple(end) for end in out["ends"]]
    return CurveData(**out)
