"""Orbits on curves of events by heyoka, which shares no code with the flow."""

import numpy as np
import pytest

import gearchaos as gc
from tests.flows import central_difference

heyoka_oracle = pytest.importorskip("tests.oracles.heyoka_oracle", exc_type=ImportError)

SINGLE = gc.MeshModel.of(kind="single", omega=1.0, zeta=0.025, q0=0.1, eps1=0.05)


def image(model: gc.MeshModel, state: np.ndarray, period: int) -> np.ndarray:
    """z and z' after mesh periods, (2,)."""
    start = dict(zip(("z", "z_dot"), map(float, state), strict=True))
    end = heyoka_oracle.section(model.with_values(start), period)
    return np.array([end[n][-1] for n in ("z", "z_dot")])


def monodromy(model: gc.MeshModel, state: np.ndarray, period: int) -> np.ndarray:
    """Derivative (2, 2) of the image by the state."""
    return np.column_stack([central_difference(lambda h, e=e: image(model, state + h * e, period), 1e-4)
                            for e in np.eye(2)])


@pytest.mark.parametrize(("event", "plane", "period", "critical"), [
    ("fold", ("omega=0.5:1.2", "eps1=0.02:0.08"), 1, 1), ("flip", ("omega=0.5:1.2", "eps1=0.02:0.1"), 1, -1)])
def test_the_critical_multiplier_on_a_curve(event, plane, period, critical):
    model = SINGLE if event == "fold" else SINGLE.with_values({"omega": 1.2, "eps1": 0.1})
    ds = gc.curve(model, event, *plane, period=period)
    middle = np.linspace(0, ds.sizes["point"] - 1, 7).astype(int)[1:-1]
    assert len(set(middle)) == 5
    for i in middle:
        at = model.with_values({n: float(ds[n][i]) for n in ("omega", "eps1")})
        state = np.array([float(ds[f"section_{n}"][i, 0]) for n in ("z", "z_dot")])
        np.testing.assert_allclose(image(at, state, period), state, atol=1e-10)
        assert abs(np.linalg.det(monodromy(at, state, period) - critical * np.eye(2))) < 1e-7
        beside = at.with_values({"omega": at.omega * 1.001})
        assert abs(np.linalg.det(monodromy(beside, state, period) - critical * np.eye(2))) > 1e-4
