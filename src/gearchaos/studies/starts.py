"""Where to start from: ranges of initial values and points spread evenly over them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gearchaos.errors import InputError
from gearchaos.model import MeshModel, vary
from gearchaos.switched import coordinates

_HALF_WIDTH = {"": 3.0, "_dot": 2.0}


def default_box(model: MeshModel) -> dict[str, tuple[float, float]]:
    """Ranges of the initial values that matter for the relative motion."""
    names = {"z": "x1", "z_dot": "x1_dot", "y": "y1", "y_dot": "y1_dot"} if model.kind != "single" else {}
    chosen = [names.get(n, n) for n in coordinates(vary(model, {}))]
    widths = {n: _HALF_WIDTH["_dot" if n.endswith("_dot") else ""] for n in chosen}
    return {n: (-w, w) for n, w in widths.items()}


def spread(box: Mapping[str, tuple[float, float]], starts: int, seed: int) -> dict[str, np.ndarray]:
    """``starts`` values (starts,) of each initial value in the box, from a scrambled Sobol sequence."""
    from scipy.stats import qmc  # here, since scipy.stats takes a second to load

    for name, (low, high) in box.items():
        if not (np.isfinite(low) and np.isfinite(high) and low < high):
            raise InputError(f"box {name}", "must be two finite numbers, the smaller one first", (low, high))
    unit = qmc.Sobol(len(box), seed=np.random.default_rng(seed)).random_base2(int(np.ceil(np.log2(starts))))[:starts]
    return {n: low + (high - low) * u for (n, (low, high)), u in zip(box.items(), unit.T, strict=True)}
