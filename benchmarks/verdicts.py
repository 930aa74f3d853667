"""The time saved in a map by stopping each cell once it is classified, compared with equally long runs of all cells.

Both run figure 2a with the same kernels, tiles and threads. The fixed run of a cell is the longest transient that the
adaptive one allows, then 250 periods with a tangent vector for the exponent, then 96 periods for the response. Prints
both CPU times, their ratio, and the share of the cells that differ: the fixed run classifies a cell by its last
stroboscopic states and its exponent, without Newton's method.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from functools import partial

import numpy as np

from gearchaos.dynamics import Classification, Label
from gearchaos.dynamics.time_series import exponents_from_growth
from gearchaos.execute import tiles
from gearchaos.flow import ExactFlow
from gearchaos.model import vary
from gearchaos.model.coordinates import initial_state
from gearchaos.model.switched import switched_system
from gearchaos.paper.settings import all_figures
from gearchaos.studies.core.axis import Axis, at_cells
from gearchaos.studies.maps.zones import zones

STUDY = all_figures()[2].studies["a"]
_SECTIONS = 257
"""Stroboscopic states in which a period is sought; the longest that can be found is 128T."""

_RETURN = 1e-6
"""Largest difference of states one period apart."""

_POSITIVE = 1e-3
"""Smallest exponent that counts as chaos."""


def fixed(axes: list[Axis], transient: int) -> np.ndarray:
    """The period of every cell, -1 for chaos, 0 for neither; (rows * columns,), after the same transient for all."""
    found = np.zeros(axes[0].count * axes[1].count, dtype=int)
    order = np.arange(len(found)).reshape(axes[1].count, axes[0].count).T.ravel()

    def work(tile: slice) -> np.ndarray:
        batch = vary(STUDY.mesh_model, at_cells(*axes, order[tile]))
        system = switched_system(batch)
        flow, tangent = ExactFlow(system), np.full((1, 2, system.points), np.sqrt(0.5))
        settled = flow.advance(initial_state(batch, system).T.copy(), transient, sections=_SECTIONS)
        run = flow.advance(settled.w, 250, tangent=tangent, growth=True)
        flow.advance(run.w, 96, measured=True)
        exponent = exponents_from_growth(run.growth, system.period)
        chaotic = (exponent.low[0] > 0) & (exponent.value[0] > _POSITIVE)
        return np.where(chaotic, -1, _period(settled.sections))

    for tile, label in tiles.run(work, tiles.split(len(order))):
        found[order[tile]] = label
    return found


def _period(sections: np.ndarray) -> np.ndarray:
    """The smallest period (L,) after which sections (S, d, L) repeat, 0 for none."""
    period = np.zeros(sections.shape[2], dtype=int)
    for n in range(len(sections) // 2, 0, -1):
        period[np.abs(sections[n:] - sections[:-n]).max(axis=(0, 1)) < _RETURN] = n
    return period


def adaptive(axes: list[Axis], longest_transient: int) -> np.ndarray:
    """The result of `zones` with this longest transient, in the form of `fixed`."""
    found = zones(STUDY.mesh_model, *axes, settings=Classification(longest_transient=longest_transient))
    return np.where(found.label == Label.CHAOTIC, -1, found.period).ravel()


def timed(work: Callable[[], np.ndarray]) -> tuple[float, float, np.ndarray]:
    """Wall and CPU seconds of a call, and what it returns."""
    wall, cpu = time.perf_counter(), time.process_time()
    result = work()
    return time.perf_counter() - wall, time.process_time() - cpu, result


def main() -> None:
    """Compile, then time both."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--columns", type=int, default=400)
    parser.add_argument("--rows", type=int, default=300)
    parser.add_argument("--longest-transient", type=int, default=Classification().longest_transient)
    given = parser.parse_args()
    axes, few = (
        [Axis(n, r.start, r.stop, c) for (n, r), c in zip(STUDY.axes.items(), counts, strict=True)]
        for counts in ((given.columns, given.rows), (16, 12))
    )
    fixed(few, 300), adaptive(few, 300)
    cpu, found = {}, {}
    for name, work in (("adaptive", adaptive), ("fixed", fixed)):
        wall, cpu[name], found[name] = timed(partial(work, axes, given.longest_transient))
        print(f"{name:9s} {cpu[name]:8.1f} s CPU {wall:8.1f} s wall", flush=True)
    differ = np.mean(found["adaptive"] != found["fixed"])
    print(f"{given.columns} x {given.rows} cells, {given.longest_transient} periods: the fixed run takes "
          f"{cpu['fixed'] / cpu['adaptive']:.2f} times as long; {differ:.2%} of the cells differ")


if __name__ == "__main__":
    main()
