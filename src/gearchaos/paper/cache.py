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
from gearchaos.paper.settings import FigureSettings, FigureStudy, Quality, study_of
from gearchaos.studies import Axis, Verdict
from gearchaos.studies.maps.bifurcation import bifurcation
from gearchaos.studies.maps.zones import zones
from gearchaos.studies.motion.basins import basins
from gearchaos.studies.motion.regime import regime
from gearchaos.studies.motion.simulate import simulate

TRANSIENT, SAMPLES = 3000, 64
"""Mesh periods before a portrait or trajectory is recorded, and samples per mesh period of a trajectory."""


class _Requests(threading.local):
    """Keys of the results that each thread has requested."""

    def __init__(self) -> None:
        self.keys: list[str] = []


class ComputationCache:
    """Results of the studies of the figures, and of further computations for the claims, at one quality."""

    def __init__(self, quality: Quality, *, progress: bool = False) -> None:
        self.quality, self.progress = quality, progress
        self.settings = Classification(longest_transient=quality.longest_transient)  # of maps
        self._known: dict[str, Any] = {}
        self._locks: dict[str, threading.RLock] = {}
        self._requests = _Requests()

    def figure(self, figure: FigureSettings) -> dict[str, xr.Dataset]:
        """The Datasets of one figure, by the names of its studies."""
        data: dict[str, xr.Dataset] = {}
        for name in figure.studies:
            found = self.study(f"{figure.number}{name}")
            data.update({name: found} if isinstance(found, xr.Dataset) else found)
        return data

    def study(self, panel: str) -> Any:
        """The study of a panel such as "2a": a Dataset, or for ``attractors`` a Dataset for each motion."""
        study = study_of(panel)
        return self.cached(f"figure {panel}", lambda: self._computed(study))

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
        return self.cached(f"{count} stroboscopic points at {_described(values)}",
                           lambda: simulate(MeshModel.of(**values), count, transient=TRANSIENT))

    def scan(self, axis: Axis, *, long_transients: bool = False, **values: Any) -> xr.Dataset:
        """Verdicts at the values of one axis, without stroboscopic points; ``values`` are those of the model by name.

        With ``long_transients`` motions are followed as long as by `gearchaos.regime` before they are called chaotic.
        """
        settings = SINGLE_MOTION if long_transients else None
        return self.cached(f"{_range(axis)} at {_described(values)}{', waited for longer' if long_transients else ''}",
                           lambda: bifurcation(MeshModel.of(**values), axis, points=0, settings=settings))

    def map(self, model: MeshModel, x: Axis, y: Axis) -> xr.Dataset:
        """A map of verdicts over two axes."""
        return self.cached(f"map over {_range(x)} and {_range(y)} of {model}",
                           lambda: zones(model, x, y, settings=self.settings))

    def _computed(self, study: FigureStudy) -> Any:
        """The result of one study of a figure."""
        quality, model, progress = self.quality, study.mesh_model, self.progress
        columns, points = quality.bifurcation
        counts = {"zones": quality.zones, "basins": quality.basins, "bifurcation": (columns,)}.get(study.kind, ())
        axes = [Axis(name, r.start, r.stop, n) for (name, r), n in zip(study.axes.items(), counts, strict=True)]
        match study.kind:
            case "zones":
                return zones(model, *axes, settings=self.settings, progress=progress)
            case "basins":
                return basins(model, *axes, progress=progress)
            case "bifurcation":
                return bifurcation(model, *axes, points=points, progress=progress)
            case "portrait":
                return simulate(model, quality.portrait, transient=TRANSIENT)
            case "trajectory":
                return simulate(model, quality.trajectory, transient=TRANSIENT, samples=SAMPLES)
        # of attractors two cycles of the motion on each of the periods to show, as far as they were found, from one of
        # its stroboscopic points; their names are such as "4T_2", the second 4T attractor
        found = self.study(study.found_in)
        dim, periods = found["attractor_label"].dims[0], found["attractor_period"].values
        out: dict[str, xr.Dataset] = {}
        for n in sorted(set(study.periods)):
            wanted = np.flatnonzero(periods == n)[: study.periods.count(n)]
            for i, index in enumerate(wanted, start=1):
                start = {c: float(found[f"attractor_section_{c}"].isel({dim: index, "point": 0}))
                         for c in ("z", "z_dot")}
                ds = simulate(study.mesh_model.with_values(start), 2 * n, samples=4 * SAMPLES)
                share = float(found["attractor_fraction"][index])
                out[f"{n}T_{i}"] = ds.assign_attrs(orbit_period=n, share_of_starts=share)
        return out


def _described(values: Mapping[str, Any]) -> str:
    """The values in words, without the kind of model where it is the default."""
    return ", ".join(f"{name} = {value}" for name, value in sorted(values.items()) if value != "torsional")


def _range(axis: Axis) -> str:
    return f"{axis.count} values of {axis.name} from {axis.start:g} to {axis.stop:g}"
