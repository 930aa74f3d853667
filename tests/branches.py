"""Branches that several tests share."""

from functools import cache

import numpy as np
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from scipy.linalg import expm

import gearchaos as gc
from gearchaos.continuation.events import KINDS

SINGLE = gc.MeshModel.of(kind="single", omega=1.0, zeta=0.025, q0=0.1, eps1=0.05)
DOUBLED = gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.206)
PAIR = gc.GearPair(
    n1=25, n2=40, I1=4.88e-4, I2=3.2e-3, R1=0.03524, R2=0.05638, c0=4e8, k=530.0, backlash=1.2e-4, M10=85.0,
    speed="14000 rpm", error_amplitudes=["6 um"])
LOOKS = [kind for name, kind in KINDS.items() if name != "border-collision"]  # that looks as a graze does
EVENT_COLOURS = [kind.colour for kind in LOOKS]
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


def flip_determinant(omega: float) -> float:
    """det(M + 1) of z'' + 2 ζ z' + χ(τ) z = 0 over a period of `SINGLE` in permanent contact, Meissner's equation."""
    stiffness, monodromy = SINGLE.stiffness, np.eye(2)
    first = stiffness.contact_ratio - 1
    for level, share in ((1 + stiffness.chi1, first), (1 - stiffness.chi2, 1 - first)):
        rate = np.array([[0.0, 1.0], [-level, -2 * SINGLE.zeta]])
        monodromy = expm(rate * share * 2 * np.pi / omega) @ monodromy
    return float(np.linalg.det(monodromy + np.eye(2)))


def axes(width: float = 6.4, height: float = 4.8):
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure.subplots()
