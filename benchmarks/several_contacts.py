"""Speed of gearchaos and of heyoka where tooth pairs share the load, of damping laws and of trains, on one core in one
run.

Prints µs per trajectory and mesh period and their ratio, the median over rounds, with the largest difference of both
states after a period; then the time of the law ``contact`` over that of ``always``, measured in turn, and how long each
kernel takes to compile. heyoka has the same contacts: an event for
each gap, whose callback opens or closes it, and one where stiffnesses and reliefs begin or end.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from typing import Any

import heyoka as hy
import numpy as np
from throughput import KINDS, SETTINGS

from gearchaos.flow import ExactFlow, Measure
from gearchaos.gears.operation.operating import as_model
from gearchaos.gears.train.mesh import Mesh
from gearchaos.gears.train.parts import Body, Shaft
from gearchaos.gears.train.planets import PlanetarySet
from gearchaos.gears.train.train import Train
from gearchaos.model import MeshModel, ToothPairStiffness, vary
from gearchaos.model.coordinates import initial_state
from gearchaos.model.switched import SwitchedAffine, switched_system

LANES, FEW, ROUNDS = 512, 16, 5
PAIRS = ToothPairStiffness((0.7,), (0.0,), 1.6, relief_length1=0.25, relief_length2=0.25)
# the gap of 50/50 teeth, in half backlashes of 60 µm and shares of the path, up to 90 µm
CORNERS = replace(PAIRS, corner1=(38.8, 22.6), corner2=(38.8, 22.6), corner_length1=0.19, corner_length2=0.19)
_OF = 6  # parameters of heyoka's integrator for each contact
CASES: dict[str, MeshModel] = {
    "one spring, always": MeshModel.of(kind="single", zeta=0.05, q0=0.2, eps1=0.05),
    "one spring, contact": MeshModel.of(kind="single", zeta=0.05, q0=0.2, eps1=0.05, damping_law="contact"),
    "one spring, unilateral": MeshModel.of(kind="single", zeta=0.05, q0=0.2, eps1=0.05, damping_law="unilateral"),
    "pairs, no relief": MeshModel.of(kind="single", zeta=0.05, q0=0.2, eps1=0.05, damping_law="contact",
                                     stiffness=PAIRS),
    "pairs, relief": MeshModel.of(kind="single", zeta=0.05, q0=0.2, eps1=0.05, damping_law="contact",
                                  stiffness=PAIRS.with_values({"relief1": 0.2, "relief2": 0.2})),
    "pairs, corner contact": MeshModel.of(kind="single", zeta=0.05, q0=0.2, eps1=0.05, damping_law="contact",
                                          stiffness=CORNERS),
    **{f"{number} pairs at a time": MeshModel.of(
        kind="single", zeta=0.05, q0=0.2, eps1=0.05, damping_law="contact",
        stiffness=replace(CORNERS, levels=(1.1 / ratio,), contact_ratio=ratio))
       for number, ratio in (("three", 2.6), ("four", 3.4))},
    "pairs, full contact": MeshModel.of(kind="single", zeta=0.15, q0=1.5, damping_law="contact",
                                        stiffness=PAIRS.with_values({"relief1": 0.2, "relief2": 0.2})),
}
STEPS = {"levels": [3e8, 2e8], "starts": [0.0, 0.6]}


def _mesh(first: str, second: str, z1: int, z2: int, **values: Any) -> Mesh:
    return Mesh(between=(first, second), teeth=(z1, z2), base_radii=(z1 * 1e-3, z2 * 1e-3), stiffness=STEPS,
                damping=600.0, backlash=1e-4, error_amplitudes=[6e-6], **values)


def _planetary() -> Train:
    """Three planets on pins; sun, planets, carrier and ring move in the plane, the ring on a soft coupling."""
    def part(inertia: float, mass: float, at: str, damping: float, **values: Any) -> dict[str, Any]:
        return {"inertia": inertia, "mass": mass, at: {"stiffness": 1e8, "damping": damping}, **values}

    mesh = {"stiffness": STEPS, "damping": 800.0, "backlash": 1e-4}
    planets = PlanetarySet(
        count=3, teeth=(17, 37, 91), module=2.8e-3, pressure_angle=np.radians(25), sun_mesh=mesh, ring_mesh=mesh,
        sun=part(4.6e-4, 0.4, "support", 500.0, torque=100.0), ring=part(0.2, 12.0, "support", 3000.0),
        carrier=part(4.9e-2, 5.4, "support", 2000.0, torque=-100.0 * 108 / 17),
        planet=part(1.3e-3, 0.66, "pin", 500.0))
    held = Shaft(between=("ring", "ground"), stiffness=1e6, damping=100.0)
    return Train(speed=1500.0, bodies=planets.bodies, meshes=planets.meshes, shafts=[held])


TRAINS: dict[str, Train] = {
    "idler, d = 4": Train(
        speed=3000.0, meshes=[_mesh("pump", "idler", 24, 30), _mesh("idler", "motor", 30, 36, phase=1.5)],
        bodies=[Body(name="pump", inertia=1e-3, torque=20.0), Body(name="idler", inertia=4e-4),
                Body(name="motor", inertia=2e-3, torque=-30.0)]),
    "cracked tooth in 23": Train(
        speed=3000.0, bodies=[Body(name="a", inertia=2e-4, torque=30.0), Body(name="b", inertia=3e-4, torque=-60.0)],
        meshes=[_mesh("a", "b", 23, 46, contact_ratio=1.6, faults=[{"wheel": 1, "tooth": 5, "stiffness_loss": 0.3}])]),
    "two stages, d = 6": Train(
        speed=3000.0, meshes=[_mesh("motor", "wheel", 20, 40), _mesh("pinion", "load", 20, 50)],
        shafts=[Shaft(between=("wheel", "pinion"), stiffness=5e4, damping=2.0)],
        bodies=[Body(name="motor", inertia=1e-3, torque=20.0), Body(name="wheel", inertia=2e-3),
                Body(name="pinion", inertia=4e-4), Body(name="load", inertia=4e-2, torque=-100.0)]),
    "with motor and load, d = 10": Train(
        speed=3000.0, meshes=[_mesh("pinion1", "wheel1", 20, 40), _mesh("pinion2", "wheel2", 20, 40)],
        shafts=[Shaft(between=("motor", "pinion1"), stiffness=2e4, damping=2.0),
                Shaft(between=("wheel1", "pinion2"), stiffness=5e4, damping=2.0),
                Shaft(between=("wheel2", "load"), stiffness=1e5, damping=10.0)],
        bodies=[Body(name="motor", inertia=2e-2, torque=40.0), Body(name="pinion1", inertia=4e-4),
                Body(name="wheel1", inertia=2e-3), Body(name="pinion2", inertia=4e-4),
                Body(name="wheel2", inertia=4e-3), Body(name="load", inertia=0.5, torque=-160.0)]),
    "planetary set, d = 34": _planetary(),
}
hy.set_logger_level_error()


class Contacts:
    """heyoka's Taylor integrator for contacts with constant stiffness and quadratic gaps on pieces of the period.

    Parameters of the integrator: of each contact whether it is closed, its stiffness, the three coefficients of its gap
    from when the piece began, and when it began; of each mesh whether it is damped; ω, when the piece ends, and the
    harmonics of the forcing.
    """

    def __init__(self, system: SwitchedAffine) -> None:
        self.system, contacts = system, system.contacts
        meshes, sides = contacts.meshes.tolist(), contacts.sides.tolist()
        (k, d), m = contacts.rows.shape, len(sides)
        w, par = hy.make_vars(*(f"w{i}" for i in range(d))), hy.par
        first = _OF * m
        self.damped = range(first, first + k)
        omega, until = par[first + k], par[first + k + 1]
        self.forced = [(j, i) for j in range(len(contacts.orders)) for i in range(d)
                       if contacts.f_cos[:, j, i].any() or contacts.f_sin[:, j, i].any()]
        self.forcing = range(first + k + 2, first + k + 2 + 2 * len(self.forced))
        displacement, velocity = ([_dot(row, w) for row in rows] for rows in (contacts.rows, contacts.rates))
        gaps = []
        for e, (n, side) in enumerate(zip(meshes, sides, strict=True)):
            a, b, c, begin = (par[_OF * e + i] for i in range(2, _OF))
            since = hy.time - begin
            gaps.append(side * displacement[n] - a - since * (b + since * c))
        forces = [par[self.damped[n]] * contacts.damping[0, n] * velocity[n] for n in range(k)]
        for e, (n, side) in enumerate(zip(meshes, sides, strict=True)):
            forces[n] = forces[n] + par[_OF * e] * par[_OF * e + 1] * side * gaps[e]
        right = []
        for i in range(d):
            total = hy.expression(float(system.f0[0, i])) + _dot(system.A[0, i], w)
            for n in range(k):
                if contacts.pushes[0, n, i]:
                    total = total - contacts.pushes[0, n, i] * forces[n]
            for at, (j, row) in zip(self.forcing[::2], self.forced, strict=True):
                if row == i:
                    angle = float(contacts.orders[j]) * omega * hy.time
                    total = total + par[at] * hy.cos(angle) + par[at + 1] * hy.sin(angle)
            right.append(total)
        events = [hy.t_event(gap, callback=_Flip(e, self)) for e, gap in enumerate(gaps)]
        # heyoka copies callbacks, but not what a function refers to
        events.append(hy.t_event(hy.time - until, callback=lambda ta, sign: self._next(ta)))
        self.integrator = hy.taylor_adaptive(list(zip(w, right, strict=True)), [0.0] * d, t_events=events,
                                             pars=np.zeros(self.forcing.stop))

    def advance(self, w: np.ndarray, periods: int) -> np.ndarray:
        out = np.empty_like(w)
        for lane in range(w.shape[1]):
            out[:, lane] = self._one(w[:, lane], lane, periods)
        return out

    def _one(self, state: np.ndarray, p: int, periods: int) -> np.ndarray:
        ta, system, contacts = self.integrator, self.system, self.system.contacts
        edges = np.append(contacts.edges[p], 1.0)
        self.point, self.number, self.period = p, 0, 2 * np.pi / system.omega[p]
        self.pieces = [(n, edges[n], edges[n + 1]) for n in range(len(edges) - 1) if edges[n + 1] - edges[n] > 1e-13]
        ta.pars[self.damped.stop] = system.omega[p]
        forced = [(contacts.f_cos[p, j, i], contacts.f_sin[p, j, i]) for j, i in self.forced]
        ta.pars[self.forcing.start :] = np.ravel(forced)
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
        displacement = contacts.rows @ ta.state
        for e, side in enumerate(contacts.sides.tolist()):
            a, b, c = contacts.offset[p, e, n]
            stiffness = contacts.stiffness[p, e, n]
            closed = side * displacement[contacts.meshes[e]] - a > 0 and stiffness > 0
            ta.pars[_OF * e : _OF * e + _OF] = closed, stiffness, a, b / period, c / period**2, begin
        ta.pars[self.damped.stop + 1] = begin + (end - start) * period
        self.damp(ta)

    def damp(self, ta: Any) -> None:
        contacts = self.system.contacts
        closed = ta.pars[: _OF * len(contacts.sides) : _OF] > 0
        for n, at in enumerate(self.damped):
            ta.pars[at] = float(contacts.in_contact[n] and closed[contacts.meshes == n].any())


def _dot(row: np.ndarray, w: list[Any]) -> Any:
    return sum((float(x) * v for x, v in zip(row, w, strict=True) if x), start=hy.expression(0.0))


class _Flip:
    """Opens or closes a contact, and those of the same gap, since heyoka finds one event at an instant."""

    def __init__(self, contact: int, peer: Contacts) -> None:
        self.contact, self.peer = contact, peer

    def __call__(self, ta: Any, sign: int) -> bool:
        contacts, one = self.peer.system.contacts, self.contact
        own = ta.pars[_OF * one + 2 : _OF * one + _OF]
        for e, (mesh, side) in enumerate(zip(contacts.meshes, contacts.sides, strict=True)):
            same = mesh == contacts.meshes[one] and side == contacts.sides[one]
            if same and np.array_equal(ta.pars[_OF * e + 2 : _OF * e + _OF], own):
                ta.pars[_OF * e] = float(sign > 0 and ta.pars[_OF * e + 1] > 0)
        self.peer.damp(ta)
        return True


def timed(advance: Any, w: np.ndarray, periods: int) -> float:
    """Microseconds per trajectory and mesh period of one call."""
    begin = time.perf_counter()
    advance(w, periods)
    return (time.perf_counter() - begin) / w.shape[1] / periods * 1e6


def compare(name: str, model: Any, axis: str, values: np.ndarray) -> None:
    batch = vary(model, {axis: values})
    system = switched_system(batch)
    flow = ExactFlow(system)
    w = flow.advance(initial_state(batch, system).T.copy(), 300).w
    switches = flow.advance(w, 20, measured=True).measures[Measure.SWITCHES].mean() / 20
    ours = [timed(lambda w, n: flow.advance(w, n), w, 200) for _ in range(ROUNDS)]
    if system.contacts is None:  # compared in throughput.py, or without an event of a gap: contact ends with the force
        print(f"{name:24} {switches:9.2f} {np.median(ours):10.3f}")
        return
    few = np.arange(0, len(values), len(values) // FEW)
    peer, start = Contacts(system.take(few)), np.ascontiguousarray(w[:, few])
    error = np.abs(peer.advance(start, 1) - flow.advance(start, 1, points=few).w).max()
    theirs = [timed(peer.advance, start, 20) for _ in range(ROUNDS)]
    ours = [timed(lambda w, n: flow.advance(w, n), w, 200) for _ in range(ROUNDS)]
    print(f"{name:24} {switches:9.2f} {np.median(ours):10.3f} {np.median(theirs):10.1f} "
          f"{np.median(theirs) / np.median(ours):8.1f} {error:10.1e}")


def compare_laws(kind: str) -> None:
    """Print the CPU time of ``contact`` divided by that of ``always``: the mixed setting of throughput.py, in turn."""
    low, high, values = SETTINGS["mixed"]
    flows, times = [], []
    for law in ("always", "contact"):
        batch = vary(MeshModel.of(**KINDS[kind], **values, damping_law=law), {"omega": np.linspace(low, high, 4096)})
        system = switched_system(batch)
        flow = ExactFlow(system)
        flows.append((flow, flow.advance(initial_state(batch, system).T.copy(), 200).w))
    for _ in range(60):
        for flow, w in flows:
            begin = time.process_time()
            flow.advance(w, 20)
            times.append(time.process_time() - begin)
    always, contact = np.reshape(times, (-1, 2)).T
    print(f"{kind}: contact takes {np.median(contact / always):.3f} times as long as always")


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
        compare(name, model, "omega", np.linspace(0.6, 1.6, LANES))
    for name, train in TRAINS.items():
        small = len(as_model(train).state_names) < 10
        compare(name, as_model(train), "speed", np.linspace(2000.0, 9000.0, LANES if small else FEW))
    for kind in KINDS:
        compare_laws(kind)
    for law, pairs in (("always", False), ("contact", False), ("unilateral", False), ("contact", True)):
        print(f"compiled in {compile_seconds(law, pairs):5.1f} s: {'tooth pairs' if pairs else 'one spring'}, {law}")


if __name__ == "__main__":
    main()
