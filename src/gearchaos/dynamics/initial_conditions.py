"""Sets of initial conditions: ranges of initial values, and points spread evenly over them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from gearchaos.errors import InputError
from gearchaos.model import MeshModel, vary
from gearchaos.model.switched import coordinates
from gearchaos.validation import to_float

_HALF_WIDTH = {"": 3.0, "_dot": 2.0}
"""Half width of the default range of a displacement and of a velocity, dimensionless."""


def default_box(model: MeshModel) -> dict[str, tuple[float, float]]:
    """Ranges of the initial values on which the relative motion depends."""
    names = {"z": "x1", "z_dot": "x1_dot", "y": "y1", "y_dot": "y1_dot"} if model.kind in ("torsional", "full") else {}
    chosen = [names.get(n, n) for n in coordinates(vary(model, {}))]
    widths = {n: _HALF_WIDTH["_dot" if n.endswith("_dot") else ""] for n in chosen}
    return {n: (-w, w) for n, w in widths.items()}


def checked_box(box: Mapping[str, Any]) -> dict[str, tuple[float, float]]:
    """Ranges of initial values as floats; raises `InputError` for anything else. Names are not checked here."""
    if not isinstance(box, Mapping):
        raise InputError("box", "must give a range for each initial value", box, "E.g. {'x1': (-3, 3)}.")
    rule, advice, out = "must be two finite numbers, the smaller one first", "E.g. {'x1': (-3, 3)}.", {}
    for name, ends in box.items():
        if isinstance(ends, (str, bytes)) or not isinstance(ends, Iterable) or len(pair := tuple(ends)) != 2:
            raise InputError(f"box {name}", rule, ends, advice)
        low, high = (to_float(f"box {name}", end) for end in pair)
        if low >= high:
            raise InputError(f"box {name}", rule, (low, high), advice)
        out[str(name)] = (low, high)
    return out


def spread(box: Mapping[str, tuple[float, float]], starts: int, seed: int | tuple[int, ...]) -> dict[str, np.ndarray]:
    """``starts`` initial states in the box, from a scrambled Sobol sequence: by name of initial value, (starts,)."""
    from scipy.stats import qmc  # here, since scipy.stats takes a second to load

    unit = qmc.Sobol(len(box), seed=np.random.default_rng(seed)).random_base2(int(np.ceil(np.log2(starts))))[:starts]
    return {n: low + (high - low) * u for (n, (low, high)), u in zip(box.items(), unit.T, strict=True)}
