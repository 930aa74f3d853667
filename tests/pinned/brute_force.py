"""Brute force: random cells of the paper's maps, each run for 20 000 mesh periods and only then looked at.

No orbit is polished and nothing is ended early: a motion is periodic if it has come back for a long while, chaotic if
its largest exponent is positive over a long run, quasi-periodic if that exponent is zero. What is none of these by
then, or might be a spiral that takes long, is run for ten times as long. Every cell is run from seven starts that
differ by up to 3e-9: where chaos is a transient, rounding decides when it ends and on which motion, so brute force
itself may give several labels. ``python -m tests.pinned.brute_force`` writes the table anew (a few
minutes on two cores).
"""

from __future__ import annotations

import csv
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from gearchaos.dynamics.time_series import exponents_from_growth
from gearchaos.flow import OK, ExactFlow
from gearchaos.model import vary
from gearchaos.model.coordinates import initial_state
from gearchaos.model.switched import switched_system
from gearchaos.paper import settings

TABLE = Path(__file__).with_name("brute_force.csv")
FIGURES = (2, 5, 10, 11)
CELLS = 500
PERIODS = 20_000
NUDGES = (0.0, 1e-9, -1e-9, 2e-9, -2e-9, 3e-9, -3e-9)
FIELDS = ("figure", "column", "row", "x", "y", "labels", "settled", "lyapunov")
_LOOKS = (80, 160, 320, 640, 1280, 2560, 5120, 10_240, PERIODS)
_LONGEST = 512
_RETURN = 1e-6
_EXPONENT = 6000
_ZERO = 3e-4


def cells(figure: int) -> tuple[np.ndarray, np.ndarray, dict[str, np.ndarray]]:
    """Columns and rows of random cells of a map at publication quality, and their parameter values by name."""
    study, (nx, ny) = settings.all_figures()[figure].studies["a"], settings.quality("paper").zones
    chosen = np.sort(np.random.default_rng(figure).choice(nx * ny, CELLS, replace=False))
    column, row = chosen % nx, chosen // nx
    values = {
        name: np.linspace(r.start, r.stop, count)[index]
        for (name, r), count, index in zip(study.axes.items(), (nx, ny), (column, row), strict=True)
    }
    return column, row, values


def flow_of(figure: int, values: dict[str, np.ndarray]) -> tuple[ExactFlow, np.ndarray]:
    """The flow of the cells and their starts (d, cells)."""
    batch = vary(settings.all_figures()[figure].studies["a"].mesh_model, values)
    system = switched_system(batch)
    return ExactFlow(system), initial_state(batch, system).T.copy()


def returned(sections: np.ndarray) -> np.ndarray:
    """The least number of periods after which the whole record (S, d, L) repeats; 0 where it does not."""
    period = np.zeros(sections.shape[2], dtype=int)
    for n in range(_LONGEST, 0, -1):
        back = np.abs(sections[n:] - sections[:-n]).max(axis=(0, 1)) < _RETURN
        period[back] = n
    return period


def judge(figure: int) -> list[tuple]:
    """Rows of the table for one figure."""
    column, row, values = cells(figure)
    flow, w = flow_of(figure, values)
    runs = [_run(flow, w + nudge) for nudge in NUDGES]
    labels = ["|".join(dict.fromkeys(several)) for several in zip(*(run[0] for run in runs), strict=True)]
    cell = (column, row, *(map(repr, v.tolist()) for v in values.values()), labels, *runs[0][1:])
    return [(figure, *values) for values in zip(*cell, strict=True)]


def _run(flow: ExactFlow, w: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Labels of all cells from these starts, the periods after which they were seen settled, and the exponents."""
    before, settled = 0, np.zeros(CELLS, dtype=int)
    for periods in _LOOKS:
        out = flow.advance(w, periods - before, sections=min(2 * _LONGEST, periods - before))
        w, before = out.w, periods
        back = returned(out.sections) > 0 if len(out.sections) == 2 * _LONGEST else np.zeros(CELLS, dtype=bool)
        settled = np.where(back & (settled == 0), periods, np.where(back, settled, 0))
    label, exponent = _label(flow, np.arange(CELLS), w, out.sections, _EXPONENT)
    slow = np.flatnonzero(np.isin(label, ("quasi-periodic", "undecided")))
    if len(slow):
        out = flow.advance(w[:, slow], 9 * PERIODS, points=slow, sections=2 * _LONGEST)
        label[slow], exponent[slow] = _label(flow, slow, out.w, out.sections, 5 * _EXPONENT)
    return label, settled, np.round(exponent, 6)


def _label(
    flow: ExactFlow, points: np.ndarray, w: np.ndarray, sections: np.ndarray, length: int
) -> tuple[np.ndarray, np.ndarray]:
    """Labels of motions at w (d, L) and their largest exponents."""
    tangent = np.zeros((1, flow.dimension, w.shape[1]))
    tangent[:, :2] = np.sqrt(0.5)
    out = flow.advance(w, length, points=points, tangent=tangent, growth=True)
    found, period = exponents_from_growth(out.growth[100:], flow.system.period[points]), returned(sections)
    zero = np.abs(found.value[0]) < _ZERO
    kind = np.where(zero, "quasi-periodic", np.where(found.low[0] > 0, "chaotic", "undecided"))
    label = np.where(period > 0, np.char.add(period.astype(str), "T"), kind)
    return np.where(out.status == OK, label, "diverged").astype("<U16"), found.value[0]


def read() -> list[dict[str, str]]:
    """The pinned table."""
    with TABLE.open(newline="") as file:
        return list(csv.DictReader(file))


def main() -> None:
    """Write the table."""
    with ThreadPoolExecutor() as pool:
        rows = [row for part in pool.map(judge, FIGURES) for row in part]
    TABLE.parent.mkdir(exist_ok=True)
    with TABLE.open("w", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([FIELDS, *rows])


if __name__ == "__main__":
    main()
