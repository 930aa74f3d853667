"""A result is the same, bit for bit, whatever else is computed beside it: cells, order, tiles, threads."""

from dataclasses import fields

import numpy as np
import pytest
import xarray as xr

import gearchaos as gc
from gearchaos.coordinates import start
from gearchaos.flow import ExactFlow
from gearchaos.model import vary
from gearchaos.motion import Budget, classify
from gearchaos.studies import tiles
from gearchaos.switched import switched

SHORT = Budget(patience=800, extensions=1, measured=16)
LANES_LAST = ("w", "exponent", "low", "high")

KINDS = {
    "torsional": ("torsional", {}),
    "contact ratio": ("torsional", {"contact_ratio": (1.1, 1.9)}),
    "full": ("full", {}),
    "unequal": ("full", {"beta1": (0.01, 0.02), "kappa1": (0.3, 1.0)}),
}


def random_points(count, ranges):
    rng = np.random.default_rng(5)
    ranges = {"omega": (0.3, 3.0), "eps1": (0.0, 0.3), "q0": (0.0, 0.2), **ranges}
    return {name: rng.uniform(*ends, count) for name, ends in ranges.items()}


def verdicts(kind, values, chosen):
    """Everything `classify` says of the chosen points, arrays (L, ...) by name."""
    batch = vary(gc.MeshModel.of(kind=kind), {n: v[chosen] for n, v in values.items()})
    system = switched(batch)
    found = classify(ExactFlow(system), start(batch, system).T.copy(), budget=SHORT)
    out = {f.name: getattr(found, f.name) for f in fields(found) if f.name != "reading"}
    out = {n: np.moveaxis(v, -1, 0) if n in LANES_LAST else v for n, v in out.items()}
    return out | {f.name: getattr(found.reading, f.name) for f in fields(found.reading)}


@pytest.mark.parametrize("case", KINDS)
def test_a_verdict_does_not_depend_on_the_lanes_beside_it(case):
    kind, ranges = KINDS[case]
    values = random_points(120, ranges)
    whole = verdicts(kind, values, np.arange(120))
    assert len(np.unique(whole["label"])) > 1
    order = np.random.default_rng(6).permutation(120)
    for chosen in (order[:1], order[1:8], order[8:50], order[50:]):
        for name, value in verdicts(kind, values, chosen).items():
            np.testing.assert_array_equal(value, whole[name][chosen], err_msg=name)


def test_a_map_does_not_depend_on_its_tiles_threads_and_neighbours(monkeypatch):
    model, x, y = gc.MeshModel.of(q0=0.1), gc.Axis("omega", 0.4, 1.2, 24), gc.Axis("eps1", 0.0, 0.3, 10)
    whole = gc.zones(model, x, y, budget=SHORT)
    split = tiles.split
    for size, threads in ((7, 1), (50, 2)):
        monkeypatch.setattr(tiles, "split", lambda count, largest=0, size=size: split(count, size))
        xr.testing.assert_identical(gc.zones(model, x, y, budget=SHORT, threads=threads), whole)
    turned = gc.zones(model, y, x, budget=SHORT).transpose("eps1", "omega")
    xr.testing.assert_equal(turned, whole)
