"""The computations behind figures and claims: each is done once, and its result shared by all threads."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np
import xarray as xr

from gearchaos.dynamics import Classification
from gearchaos.dynamics.settings import SINGLE_MOTION
from gearchaos.model import MeshModel
from gearchaos.paper.settings import FigureSettings, FigureStudy, Quality, all_figures
from gearchaos.studies import Axis, Verdict
from gearchaos.studies.basins import basins
from gearchaos.studies.bifurcation import bifurcation
from gearchaos.studies.regime import regime
from gearchaos.studies.simulate import simulate
from gearchaos.studies.zones import zones

TRANSIENT = 3000
"""Mesh periods before a portrait or trajectory is recorded."""

SAMPLES = 64
"""Samples per mesh period of a trajectory."""


class _Requests(threading.local):
    """Keys of the results that each thread has requested."""

    def __init__(self) -> None:
        self.keys: list[str] = []


class ComputationCache:
    """Results of the studies of the figures, and of further computations for the claims, at one quality.

    Parameters
    ----------
    quality : Quality
        How finely to compute.
    progress : bool
        Show the progress bars of the studies.
    """

    def __init__(self, quality: Quality, *, progress: bool = False) -> None:
        self.quality, self.progress = quality, progress
        self._known: dict[str, Any] = {}
        self._locks: dict[str, threading.RLock] = {}
        self._requests = _Requests()

    @property
    def settings(self) -> Classification:
        """Classification settings of maps."""
        return Classification(longest_transient=self.quality.longest_transient)

    def figure(self, figure: FigureSettings) -> dict[str, xr.Dataset]:
        """The Datasets of one figure, by the names of its studies."""
        data: dict[str, xr.Dataset] = {}
        for name, study in figure.studies.items():
            found = self.study(figure.number, name, study)
            data.update({name: found} if isinstance(found, xr.Dataset) else found)
        return data

    def study(self, number: int, name: str, study: FigureStudy | None = None) -> Any:
        """One study of a figure: a Dataset, or for ``attractors`` a Dataset for each motion."""
        study = study or all_figures()[number].studies[name]
        return self.cached(f"figure {number}{name}", lambda: _KINDS[study.kind](self, study))

    def cached(self, key: str, compute: Callable[[], Any]) -> Any:
        """The result of ``compute()``, which is called only the first time with this key."""
        self._requests.keys.append(key)
        with self._locks.setdefault(key, threading.RLock()):
            if key not in self._known:
                with self.requested_keys():  # keys requested by compute() do not count as requested by the caller
                    self._known[key] = compute()
        return self._known[key]

    @contextmanager
    def requested_keys(self) -> Iterator[list[str]]:
        """The keys that this thread requests within the context, in order."""
        before, self._requests.keys = self._requests.keys, []
        try:
            yield self._requests.keys
        finally:
            self._requests.keys = before

    def known(self, key: str) -> Any:
        """A result by its key, None if there is none yet."""
        return self._known.get(key)

    def regime(self, **values: Any) -> Verdict:
        """The verdict at one operating point, given by the names that `MeshModel.of` takes."""
        return self.cached(f"the verdict at {_described(values)}", lambda: regime(MeshModel.of(**values)))

    def portrait(self, count: int, **values: Any) -> xr.Dataset:
        """The stroboscopic portrait (``count`` stroboscopic points) at one operating point."""
        return self.cached(
            f"{count} stroboscopic points at {_described(values)}",
            lambda: simulate(MeshModel.of(**values), count, transient=TRANSIENT),
        )

    def scan(self, axis: Axis, *, long_transients: bool = False, **values: Any) -> xr.Dataset:
        """Verdicts at the values of one axis, without stroboscopic points.

        With ``long_transients`` motions are followed for as long as by `gearchaos.regime` before they are called
        chaotic. ``values`` are those of the model by name, as in `regime`.
        """
        return self.cached(
            f"{_range(axis)} at {_described(values)}{', waited for longer' if long_transients else ''}",
            lambda: bifurcation(
                MeshModel.of(**values), axis, points=0, settings=SINGLE_MOTION if long_transients else None),
        )

    def map(self, model: MeshModel, x: Axis, y: Axis) -> xr.Dataset:
        """A map of verdicts over two axes."""
        return self.cached(
            f"map over {_range(x)} and {_range(y)} of {model}",
            lambda: zones(model, x, y, settings=self.settings),
        )


def _described(values: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} = {value}" for name, value in sorted(values.items()))


def _range(axis: Axis) -> str:
    return f"{axis.count} values of {axis.name} from {axis.start:g} to {axis.stop:g}"


def _axes(study: FigureStudy, counts: tuple[int, ...]) -> list[Axis]:
    return [
        Axis(name, r.start, r.stop, count)
        for (name, r), count in zip(study.axes.items(), counts, strict=True)
    ]


def _zones(cache: ComputationCache, study: FigureStudy) -> xr.Dataset:
    return zones(
        study.mesh_model, *_axes(study, cache.quality.zones), settings=cache.settings, progress=cache.progress
    )


def _basins(cache: ComputationCache, study: FigureStudy) -> xr.Dataset:
    return basins(study.mesh_model, *_axes(study, cache.quality.basins), progress=cache.progress)


def _bifurcation(cache: ComputationCache, study: FigureStudy) -> xr.Dataset:
    columns, points = cache.quality.bifurcation
    (axis,) = _axes(study, (columns,))
    return bifurcation(study.mesh_model, axis, points=points, progress=cache.progress)


def _portrait(cache: ComputationCache, study: FigureStudy) -> xr.Dataset:
    return simulate(study.mesh_model, cache.quality.portrait, transient=TRANSIENT)


def _trajectory(cache: ComputationCache, study: FigureStudy) -> xr.Dataset:
    return simulate(study.mesh_model, cache.quality.trajectory, transient=TRANSIENT, samples=SAMPLES)


def _attractors(cache: ComputationCache, study: FigureStudy) -> dict[str, xr.Dataset]:
    """Orbits of the periods to show, by name such as "4T_2" for the second 4T attractor; only those that were found."""
    found = cache.study(int(study.found_in[:-1]), study.found_in[-1])
    periods = found["attractor_period"].values
    out: dict[str, xr.Dataset] = {}
    for n in sorted(set(study.periods)):
        wanted = np.flatnonzero(periods == n)[: study.periods.count(n)]
        for i, index in enumerate(wanted, start=1):
            out[f"{n}T_{i}"] = _orbit(study.mesh_model, found, int(index))
    return out


def _orbit(model: MeshModel, found: xr.Dataset, index: int) -> xr.Dataset:
    """Two cycles of the motion on one attractor, from one of its stroboscopic points."""
    dim = found["attractor_label"].dims[0]
    start = {n: float(found[f"attractor_section_{n}"].isel({dim: index, "point": 0})) for n in ("z", "z_dot")}
    period = int(found["attractor_period"][index])
    ds = simulate(model.with_values(start), 2 * period, samples=4 * SAMPLES)
    return ds.assign_attrs(orbit_period=period, share_of_starts=float(found["attractor_fraction"][index]))


_KINDS: dict[str, Callable[[ComputationCache, FigureStudy], Any]] = {
    "zones": _zones,
    "basins": _basins,
    "bifurcation": _bifurcation,
    "portrait": _portrait,
    "trajectory": _trajectory,
    "attractors": _attractors,
}
"""The function for each kind of study in `settings.toml`."""
