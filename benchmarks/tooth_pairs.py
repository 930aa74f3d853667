"""Speed of gearchaos and of heyoka where tooth pairs share the load, and of the damping laws, on one core in one run.

Prints µs per trajectory and mesh period and their ratio, the median over rounds, with the largest difference of both
states after a period; then how long each kernel takes to compile. heyoka has the same contacts: an event for
each gap, whose callback opens or closes it, and one where stiffnesses and reliefs begin or end.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import heyoka as hy
import numpy as np

from gearchaos.flow import ExactFlow, Measure
from gearchaos.model import MeshModel, ToothPairStiffness, vary
from gearchaos.model.switched import SwitchedAffine, switched_system

LANES, FEW, ROUNDS = 512, 16, 5
PAIRS = ToothPairStiffness((0.7,), (0.0,), 1.6, relief_length1=0.25, relief_length2=0.25)
CASES: dict[str, MeshModel] = {
    "one spring, always": MeshModel.of(kind="single", zeta=0.05, q0=0.2, eps1=0.05),
    "one spring, contact": MeshModel.of(kind="single", zeta=0.05, q0=0.2, eps1=0.05, damping_law="contact"),
    "one spring, unilateral": MeshModel.of(kind="single", zeta=0.05, q0=0.2, eps1=0.05, damping_law="unilateral"),
    "pairs, no relief": MeshModel.of(kind="single", zeta=0.05, q0=0.2, eps1=0.05, damping_law="contact",
                                     stiffness=PAIRS),
    "pairs, relief": MeshModel.of(kind="single", zeta=0.05, q0=0.2, eps1=0.05, damping_law="contact",
                                  stiffness=PAIRS.with_values({"relief1": 0.2, "relief2": 0.2})),
    "pairs, full contact": MeshModel.of(kind="single", zeta=0.15, q0=1.5, damping_law="contact",
                                        stiffness=PAIRS.with_values({"relief1": 0.2, "relief2": 0.2})),
}
hy.set_logger_level_error()


class Pairs:
    """heyoka's Taylor integrator for contacts with constant stiffness and linear gaps on pieces of the period.

    Parameters of the integrator: of each contact whether it is closed, its stiffness, its gap when the piece began, the
    rate of that, and when it began; then whether the mesh is damped, ω, 2ζ, force, error, and when the piece ends.
    """

    def __init__(self, system: SwitchedAffine) -> None:
        if system.contacts is None:  # one spring is a contact on each flank
            levels = np.repeat(system.levels[:, None], 2, axis=1)
            system = replace(system, contacts=SimpleNamespace(
                sides=np.array([1, -1]), edges=system.starts, stiffness=levels,
                offset=np.broadcast_to([1.0, 0.0, 0.0], (*levels.shape, 3))))
        self.system, m = system, len(system.contacts.sides)
        z, v = hy.make_vars("z", "v")
        par, own = hy.par, 5 * m
        damped, omega, damping, force, error = (par[own + i] for i in range(5))
        until = par[own + 5]
        gaps = [side * z - par[5 * e + 2] - par[5 * e + 3] * (hy.time - par[5 * e + 4])
                for e, side in enumerate(system.contacts.sides.tolist())]
        spring = sum((par[5 * e] * par[5 * e + 1] * side * gaps[e]
                      for e, side in enumerate(system.contacts.sides.tolist())), start=hy.expression(0.0))
        events = [hy.t_event(gap, callback=_Flip(e, system)) for e, gap in enumerate(gaps)]
        # heyoka copies callbacks, but not what a function refers to
        events.append(hy.t_event(hy.time - until, callback=lambda ta, sign: self._next(ta)))
        right = force + error * hy.cos(omega * hy.time) - spring - damped * damping * v
        self.integrator = hy.taylor_adaptive([(z, v), (v, right)], [0.0, 0.0], t_events=events,
                                             pars=np.zeros(own + 6))

    def advance(self, w: np.ndarray, periods: int) -> np.ndarray:
        out = np.empty_like(w)
        for lane in range(w.shape[1]):
            out[:, lane] = self._one(w[:, lane], lane, periods)
        return out

    def _one(self, state: np.ndarray, p: int, periods: int) -> np.ndarray:
        ta, system, m = self.integrator, self.system, len(self.system.contacts.sides)
        edges = np.append(system.contacts.edges[p], 1.0)
        self.point, self.number, self.period = p, 0, 2 * np.pi / system.omega[p]
        self.pieces = [(n, edges[n], edges[n + 1]) for n in range(len(edges) - 1) if edges[n + 1] - edges[n] > 1e-13]
        ta.pars[5 * m + 1 : 5 * m + 5] = system.omega[p], system.damping[p], system.f0[p, 1], system.f_cos[p, 0]
        ta.time, ta.state[:] = 0.0, state
        ta.reset_cooldowns()
        self._begin(ta)
        ta.propagate_until(periods * self.period)
        return ta.state

    def _next(self, ta: Any) -> bool:
        self.number += 1
        self._begin(ta)
        return True

    def _begin(self, ta: Any) -> None:
        """Write the numbers of a piece, and the contacts at its beginning, to the parameters."""
        contacts, period, p = self.system.contacts, self.period, self.point
        n, start, end = self.pieces[self.number % len(self.pieces)]
        begin = (self.number // len(self.pieces) + start) * period
        for e, side in enumerate(contacts.sides.tolist()):
            a, b, _ = contacts.offset[p, e, n]
            stiffness = contacts.stiffness[p, e, n]
            closed = side * ta.state[0] - a > 0 and stiffness > 0
            ta.pars[5 * e : 5 * e + 5] = closed, stiffness, a, b / period, begin
        ta.pars[-1] = begin + (end - start) * period
        _damp(ta, self.system)


class _Flip:
    """Opens or closes a contact, and those of the same gap, since heyoka finds one event at an instant."""

    def __init__(self, contact: int, system: SwitchedAffine) -> None:
        self.contact, self.system, self.sides = contact, system, system.contacts.sides

    def __call__(self, ta: Any, sign: int) -> bool:
        own = ta.pars[5 * self.contact + 2 : 5 * self.contact + 5]
        for e, side in enumerate(self.sides):
            if side == self.sides[self.contact] and np.array_equal(ta.pars[5 * e + 2 : 5 * e + 5], own):
                ta.pars[5 * e] = float(sign > 0 and ta.pars[5 * e + 1] > 0)
        _damp(ta, self.system)
        return True


def _damp(ta: Any, system: SwitchedAffine) -> None:
    m = len(system.contacts.sides)
    ta.pars[5 * m] = float(system.damping_law == "always" or ta.pars[: 5 * m : 5].any())


def timed(advance: Any, w: np.ndarray, periods: int) -> float:
    """Microseconds per trajectory and mesh period of one call."""
    begin = time.perf_counter()
    advance(w, periods)
    return (time.perf_counter() - begin) / w.shape[1] / periods * 1e6


def compare(name: str, model: MeshModel) -> None:
    system = switched_system(vary(model, {"omega": np.linspace(0.6, 1.6, LANES)}))
    flow = ExactFlow(system)
    w = flow.advance(np.array([[1.3], [0.0]]) * np.ones(LANES), 300).w
    switches = flow.advance(w, 20, measured=True).measures[Measure.SWITCHES].mean() / 20
    ours = [timed(lambda w, n: flow.advance(w, n), w, 200) for _ in range(ROUNDS)]
    if system.damping_law == "unilateral":  # contact ends with the force: no event of a gap
        print(f"{name:24} {switches:9.2f} {np.median(ours):10.3f}")
        return
    few = np.arange(0, LANES, LANES // FEW)
    peer, start = Pairs(system.take(few)), np.ascontiguousarray(w[:, few])
    error = np.abs(peer.advance(start, 1) - flow.advance(start, 1, points=few).w).max()
    theirs = [timed(peer.advance, start, 20) for _ in range(ROUNDS)]
    ours = [timed(lambda w, n: flow.advance(w, n), w, 200) for _ in range(ROUNDS)]
    print(f"{name:24} {switches:9.2f} {np.median(ours):10.3f} {np.median(theirs):10.1f} "
          f"{np.median(theirs) / np.median(ours):8.1f} {error:10.1e}")


def compile_seconds(law: str, pairs: bool) -> float:
    """Seconds of the first computation with an empty cache of kernels, in a process of its own."""
    stiffness = "gc.ToothPairStiffness()" if pairs else "gc.TwoLevelStiffness()"
    code = ("import time, gearchaos as gc; from gearchaos.flow import ExactFlow; from gearchaos.model import vary; "
            "from gearchaos.model.switched import switched_system; import numpy as np; "
            f"m = gc.MeshModel.of(kind='single', damping_law={law!r}, stiffness={stiffness}); t = time.time(); "
            "ExactFlow(switched_system(vary(m, {}))).advance(np.zeros((2, 1)), 1); print(time.time() - t)")
    with tempfile.TemporaryDirectory() as folder:
        out = subprocess.run([sys.executable, "-c", code], env={**os.environ, "NUMBA_CACHE_DIR": folder},
                             capture_output=True, text=True, check=True)
    return float(out.stdout)


def main() -> None:
    print(f"{'':24} {'switches':>9} {'us/period':>10} {'heyoka':>10} {'ratio':>8} {'difference':>10}")
    for name, model in CASES.items():
        compare(name, model)
    for law, pairs in (("always", False), ("contact", False), ("unilateral", False), ("contact", True)):
        print(f"compiled in {compile_seconds(law, pairs):5.1f} s: {'tooth pairs' if pairs else 'one spring'}, {law}")


if __name__ == "__main__":
    main()
