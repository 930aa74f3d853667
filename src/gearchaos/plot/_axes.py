"""What all pictures share: a fresh Axes, labels in words and symbols, the edges of cells."""

from __future__ import annotations

import json

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

_SYMBOLS = {
    "omega": r"\omega", "zeta": r"\zeta", "q0": "q_0", "kappa": r"\kappa", "beta": r"\beta", "mu": r"\mu", "J": "J",
    "chi0": r"\chi_0", "contact_ratio": r"\alpha", "v_rms": r"V_\mathrm{RMS}", "lyapunov": r"\lambda_1", "z": "z",
    "z_dot": r"\dot{z}", "tau": r"\tau", "mesh_force": "S", "zeta_support": r"\zeta_{1,2}",
}
"""Symbols of the paper, in mathtext."""

_WORDS = {
    "omega": "frequency", "eps1": "error amplitude", "q0": "static load", "kappa": "support stiffness",
    "x1": "displacement", "x1_dot": "velocity", "x2": "displacement", "x2_dot": "velocity", "z": "displacement",
    "z_dot": "velocity", "v_rms": "rms velocity", "lyapunov": "largest exponent", "mesh_force": "mesh force",
}
"""Short words for axes; other variables are called by their ``long_name``."""

_SCALES = {"1", "delta", "omega0", "c0", "T"}
"""Units that make a quantity dimensionless, (2.8)-(2.11); only others are worth a place on an axis."""

_NUMBERED = {
    "eps": r"\varepsilon", "theta": r"\theta", "c": "c", "alpha": r"\alpha", "x": "x", "y": "y", "q": "q", "J": "J",
    "mu": r"\mu", "kappa": r"\kappa", "beta": r"\beta", "zeta_support": r"\zeta", "chi": r"\chi",
}


def new_axes(ax: Axes | None) -> Axes:
    """``ax`` itself, or the Axes of a new pyplot figure."""
    if ax is not None:
        return ax
    import matplotlib.pyplot as plt

    return plt.subplots(layout="constrained")[1]


def symbol(name: str) -> str:
    """The paper's symbol of a variable or parameter in mathtext, or the name itself."""
    if name in _SYMBOLS:
        return f"${_SYMBOLS[name]}$"
    stem = name.removesuffix("_dot")
    head = stem.rstrip("0123456789")
    if head in _NUMBERED and head != stem:
        sign = rf"\dot{{{_NUMBERED[head]}}}" if name.endswith("_dot") else _NUMBERED[head]
        return f"${sign}_{{{stem[len(head):]}}}$"
    return name.replace("_", " ")


def axis_label(array: xr.DataArray | xr.Variable, name: str) -> str:
    """Words, symbol and unit, e.g. ``frequency ω``; units that only make dimensionless are left out."""
    words, sign = _WORDS.get(name, array.attrs.get("long_name", "")), symbol(name)
    text = f"{words} {sign}" if words and sign.startswith("$") and words != name else words or sign
    unit = array.attrs.get("units", "1")
    return text if set(unit.replace("/", "*").split("*")) <= _SCALES else f"{text} [{unit}]"


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
