"""Branches that several tests share."""

from __future__ import annotations

from functools import cache

import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import gearchaos as gc

SINGLE = gc.MeshModel.of(kind="single", omega=1.0, zeta=0.025, q0=0.1, eps1=0.05)
DOUBLED = gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.206)
PAIR = gc.GearPair(
    n1=25, n2=40, I1=4.88e-4, I2=3.2e-3, R1=0.03524, R2=0.05638, c0=4e8, k=530.0, backlash=1.2e-4, M10=85.0,
    speed="14000 rpm", error_amplitudes=["6 um"],
)
CHANGES = ("fold", "flip", "neimark-sacker", "pitchfork")


@cache
def resonance() -> xr.Dataset:
    return gc.branch(SINGLE, "omega=0.3:2.5")


@cache
def cascade() -> xr.Dataset:
    return gc.branch(DOUBLED, "eps1=0:0.3", cascade=2)


@cache
def over_speed() -> xr.Dataset:
    return gc.branch(PAIR, "speed=3000:30000")


def axes(width: float = 6.4, height: float = 4.8):
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure.subplots()
