"""Curves, skeletons, maps and manifolds that several tests share."""

from functools import cache
from typing import Any

import xarray as xr

import gearchaos as gc
from tests.branches import SINGLE
from tests.branches import axes as axes

FULL = gc.MeshModel.of(kind="full", kappa=0.5, omega=1.05, eps1=0.02)
SMALL = gc.MeshModel.of(q0=0.1)
WINDOW = {"x": "omega=1.7:2.3:8", "y": "eps1=0.03:0.09:4"}
SEARCH: dict[str, Any] = {"period": 2, "lines": (1, 1), "starts": 0, "workers": 1}
QUICK = {**SEARCH, "period": 1}


@cache
def folds() -> xr.Dataset:
    return gc.curve(SINGLE, "fold", "omega=0.5:1.2", "eps1=0.02:0.08", period=1)


def state_at(ds: xr.Dataset, i: int) -> dict[str, float]:
    """The first stroboscopic point of an orbit of a curve by names of initial values."""
    return {str(n)[8:]: float(ds[n][i, 0]) for n in ds.data_vars if str(n).startswith("section_")}


def model_at(model: gc.MeshModel, ds: xr.Dataset, i: int) -> gc.MeshModel:
    return model.with_values({str(n): float(ds[n][i]) for n in ds.coords})


@cache
def small() -> xr.Dataset:
    return gc.skeleton(SMALL, **WINDOW, **SEARCH)


@cache
def quick() -> xr.Dataset:
    return gc.skeleton(SMALL, **WINDOW, **QUICK)


@cache
def zones() -> xr.Dataset:
    return gc.zones(SMALL, "omega=1.7:2.3:12", "eps1=0.03:0.09:8")


@cache
def manifolds() -> xr.Dataset:
    return gc.manifolds(SINGLE.with_values({"omega": 2.3}), period=3, length=4, spacing=0.1)
