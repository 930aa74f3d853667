"""What all pictures share: a fresh Axes, labels in words and symbols, the edges of cells."""

from __future__ import annotations

import json

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

SYMBOLS = {
    "omega": r"\omega", "zeta": r"\zeta", "q0": r"q_0", "q1": r"q_1", "q2": r"q_2", "kappa": r"\kappa",
    "kappa1": r"\kappa_1", "kappa2": r"\kappa_2", "beta": r"\beta", "beta1": r"\beta_1", "beta2": r"\beta_2",
    "mu": r"\mu", "mu1": r"\mu_1", "mu2": r"\mu_2", "J": "J", "J1": "J_1", "J2": "J_2", "chi0": r"\chi_0",
    "chi1": r"\chi_1", "chi2": r"\chi_2", "contact_ratio": r"\alpha", "zeta_support": r"\zeta_{1,2}",
    "zeta_support1": r"\zeta_1", "zeta_support2": r"\zeta_2", "v_rms": r"V_{RMS}", "lyapunov": r"\lambda_1",
    "z": "z", "z_dot": r"\dot{z}", "tau": r"\tau", "mesh_force": "S",
}
"""Symbols of the paper, in mathtext."""

_NUMBERED = {"eps": r"\varepsilon", "theta": r"\theta", "c": "c", "alpha": r"\alpha", "x": "x", "y": "y"}


def new_axes(ax: Axes | None) -> Axes:
    """``ax`` itself, or the Axes of a new pyplot figure."""
    if ax is not None:
        return ax
    import matplotlib.pyplot as plt

    return plt.subplots(layout="constrained")[1]


def symbol(name: str) -> str:
    """The paper's symbol of a variable or parameter in mathtext, or the name itself."""
    stem = name.removesuffix("_dot")
    head, digits = stem.rstrip("0123456789"), stem[len(stem.rstrip("0123456789")):]
    if name in SYMBOLS:
        return f"${SYMBOLS[name]}$"
    if head in _NUMBERED and digits:
        dot = r"\dot{%s}" if name.endswith("_dot") else "%s"
        return f"${dot % _NUMBERED[head]}_{{{digits}}}$"
    return name.replace("_", " ")


def axis_label(array: xr.DataArray, name: str) -> str:
    """Words, symbol and unit, e.g. ``mesh frequency ω``; the words and the unit come from the attributes."""
    words, unit, sign = array.attrs.get("long_name", ""), array.attrs.get("units", "1"), symbol(name)
    text = f"{words} {sign}" if words and words not in (name, sign) else sign
    return text if unit in ("1", "") or unit.startswith("1/omega0") else f"{text} [{unit}]"


def cell_extent(x: np.ndarray, y: np.ndarray) -> tuple[float, float, float, float]:
    """The outer edges (left, right, bottom, top) of equidistant cells with the given centres."""
    return (*_edges(np.asarray(x, float)), *_edges(np.asarray(y, float)))


def _edges(centres: np.ndarray) -> tuple[float, float]:
    half = (centres[-1] - centres[0]) / (2 * (len(centres) - 1)) if len(centres) > 1 else 0.5
    return float(centres[0] - half), float(centres[-1] + half)


def mesh_period(ds: xr.Dataset) -> float:
    """T = 2π/ω in units of τ, from the model that a Dataset carries."""
    return 2 * np.pi / model_values(ds)["omega"]


def model_values(ds: xr.Dataset) -> dict:
    """The model of a Dataset as plain values."""
    return json.loads(ds.attrs["model"])


def plane(ds: xr.Dataset, name: str) -> tuple[str, str]:
    """Names of the horizontal and the vertical axis of a two-dimensional variable."""
    vertical, horizontal = ds[name].dims
    return str(horizontal), str(vertical)


def trim(ax: Axes, ds: xr.Dataset, horizontal: str, vertical: str) -> None:
    """Labels, and limits at the outer cell centres so that the axes span the stated ranges."""
    x, y = ds[horizontal], ds[vertical]
    ax.set(xlabel=axis_label(x, horizontal), ylabel=axis_label(y, vertical))
    if x.size > 1:
        ax.set_xlim(float(x[0]), float(x[-1]))
    if y.size > 1:
        ax.set_ylim(float(y[0]), float(y[-1]))
