"""The skeleton of a map: all curves of events of periodic orbits in a window of two parameters."""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import BrokenExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.continuation.curve_data import CurveData
from gearchaos.continuation.family import ParameterFamily
from gearchaos.continuation.skeleton import Search, find_curves
from gearchaos.datasets import new_dataset, provenance, variable
from gearchaos.errors import InputError, whole_number
from gearchaos.execute.machine import cores
from gearchaos.execute.pool import RESUME_ADVICE
from gearchaos.execute.pools import process_pool, thread_pool
from gearchaos.gears.operating import AnyModel, as_model
from gearchaos.studies.axis import Axis, as_axis, as_range
from gearchaos.studies.curve_dataset import ends_of, parameter_plane, point_variables, special_variables
from gearchaos.studies.operating_point import at_axis_starts
from gearchaos.studies.skeleton_journal import SkeletonJournal

if TYPE_CHECKING:
    import xarray as xr

_CELLS = (48, 24)
"""Numbers of places along x and y at which motions are searched, where the axes have no numbers of values."""

_LONGEST_PERIOD = 64
_MOST_LINES = 1000
_MOST_STARTS = 10_000


def skeleton(
    model: AnyModel, x: Axis | str, y: Axis | str, *, period: int = 4, lines: tuple[int, int] = (8, 5),
    starts: int = 3, journal: str | os.PathLike[str] | None = None, progress: bool = False,
    workers: int | None = None,
) -> xr.Dataset:
    """All curves of folds, flips, Neimark-Sacker bifurcations and grazes that are found in a window of two parameters.

    Stable motions are searched on lines parallel to both axes, and the branches of their orbits are followed along the
    lines, with the branches of doubled periods. Every event on them that lies on no known curve gives another curve.

    Parameters
    ----------
    model : MeshModel, GearPair or GearDesign
        All parameters but the two of the axes, and the initial values.
    x, y : Axis or str
        The parameters and their ranges, "omega=0.2:2.5:48". The numbers of values are those of the places at which
        motions are searched on a line; 48 and 24 if left out.
    period : int
        Largest period of the orbits, in mesh periods.
    lines : (int, int)
        Numbers of lines along x and along y.
    starts : int
        Number of initial states at each place, besides the model's own.
    journal : path, optional
        A file that keeps finished work. If it exists, the same call goes on from there.
    progress : bool
        Show progress bars on stderr.
    workers : int, optional
        Number of processes, by default one per core; with 1 all is computed in this process.

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
    """
    search = _search(x, y, period, lines, starts)
    x, y = as_range(x, "x"), as_range(y, "y")
    count = cores() if workers is None else whole_number("workers", workers, 1)
    family = parameter_plane(as_model(at_axis_starts(model, [x, y])), x, y)
    attributes = _attributes(family, x, y, search)
    kept = None if journal is None else SkeletonJournal(Path(journal), attributes)
    bounds = ((x.start, x.stop), (y.start, y.stop))
    try:
        with (process_pool(count) if count > 1 else thread_pool(1))() as pool:
            curves, failed = find_curves(
                family.model, (x.name, y.name), bounds, pool, search, journal=kept, progress=progress)
    except BrokenExecutor:
        raise OSError("a worker process died. A script must call skeleton under if __name__ == '__main__':, or with "
                      f"workers=1. {'' if kept is None else RESUME_ADVICE}".rstrip()) from None
    failures = json.dumps(Counter(why for _, why in failed))
    return _dataset(family, curves, {**attributes, "failed": failures})


def _search(x: Any, y: Any, period: Any, lines: Any, starts: Any) -> Search:
    """Where events are searched; raises `InputError` if a number is out of range."""
    period = whole_number("period", period, 1, _LONGEST_PERIOD)
    if not isinstance(lines, Sequence) or len(lines) != 2:
        raise InputError("lines", "must be two numbers: of lines along x and along y", lines, "E.g. (8, 5).")
    along_x, along_y = (whole_number("lines", number, 0, _MOST_LINES) for number in lines)
    if along_x == along_y == 0:
        raise InputError("lines", "must have at least one line along x or y", lines, "E.g. (8, 5).")
    cells = (_cells(x, "x", _CELLS[0]), _cells(y, "y", _CELLS[1]))
    return Search(period, (along_x, along_y), cells, whole_number("starts", starts, 0, _MOST_STARTS))


def _cells(axis: Any, field: str, default: int) -> int:
    """The number of values of an axis; the default for a text without a number."""
    if isinstance(axis, str) and axis.count(":") == 1:
        return default
    return whole_number(field, as_axis(axis, field).count, 1)


def _attributes(family: ParameterFamily, x: Axis, y: Axis, search: Search) -> dict[str, Any]:
    """Study, model, settings and versions, on which the result depends."""
    columns, rows = search.cells
    return provenance(
        "skeleton", family.model, x=[x.name, x.start, x.stop, columns], y=[y.name, y.start, y.stop, rows],
        period=search.period, lines=list(search.lines), starts=search.starts)


def _dataset(family: ParameterFamily, curves: list[CurveData], attributes: dict[str, Any]) -> xr.Dataset:
    """The Dataset that `skeleton` returns."""
    points, coordinates = point_variables(family, curves)
    number = np.arange(len(curves))
    data = {
        "curve": variable("curve", ("point",), np.repeat(number, [len(c.values) for c in curves]).astype(int)),
        **points,
        "curve_kind": variable("curve_kind", ("number",), np.array([c.kind for c in curves], dtype=object)),
        "curve_period": variable("curve_period", ("number",), np.array([c.period for c in curves], int)),
        "curve_boundary": variable("curve_boundary", ("number",), np.array([c.boundary or 0 for c in curves], int)),
        "curve_closed": variable("curve_closed", ("number",), np.array([c.closed for c in curves], bool)),
        **special_variables(family, curves),
        "special_curve": variable(
            "special_curve", ("special",), np.repeat(number, [len(c.special) for c in curves]).astype(int)),
    }
    ends = [{"curve": i, **end} for i, c in enumerate(curves) for end in ends_of(family, c)]
    return new_dataset(data, coordinates, {**attributes, "ends": json.dumps(ends)})
