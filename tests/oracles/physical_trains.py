"""Motions of a `Train` by SciPy's DOP853, in all physical coordinates, from its fields alone.

Angles θ of the free bodies, deviations from the steady rotation, are all positive in the sense of the first body; x and
y are displacements of the centres that are supported. Forces are those of virtual work, Q = −F ∂s/∂q, with
s = r_a φ_a − r_b φ_b − e(t), φ in each wheel's own sense of rotation, seen from the carrier where there is one. Every
contact is watched for the zeros of its gap, and with the law unilateral of its force; the integration is begun anew
there, and where a stiffness or a gap changes its form.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.integrate import DOP853
from scipy.optimize import brentq

from tests.oracles.stored import stored

_SHORT = 1e-13  # of a common period: instants that are as close are one
_NODES, _WEIGHTS = (0.5 * values for values in np.polynomial.legendre.leggauss(8))  # over a step
_SAMPLED = np.linspace(0, 1, 33)  # of a step, where forces are compared with their extremes
_WATCHED = np.linspace(0, 1, 9)[1:]  # of a step, where signs of gaps are compared


@dataclass
class Spring:
    """k (row·q + h) + c d/dt of that, h from the bodies whose motion is prescribed."""

    name: str
    row: np.ndarray
    prescribed: dict[str, float]
    k: float = 0.0
    c: float = 0.0


@dataclass
class Contacts(Spring):
    """The one-sided contacts of a mesh or of the stops of a shaft, in the cycle of the mesh."""

    flanks: list[tuple[int, Any]] = field(default_factory=list)
    # side, and a function (stiffness, gap) of two shares of a cycle: one in the piece whose form is meant, and its own
    marks: tuple[float, ...] = ()  # shares of the cycle at which pieces begin
    order: float = 0.0  # cycles in a turn of the first body
    phase: float = 0.0  # share of a cycle at t = 0
    always: bool = False
    error: Any = None
    releases: bool = False


@dataclass
class Measured:
    """Of a mesh over a motion, in SI."""

    front_time: float = 0.0
    back_time: float = 0.0
    force_square: float = 0.0  # integrals over the time
    force: float = 0.0
    largest: float = -np.inf
    smallest: float = np.inf
    switches: int = 0  # beginnings and ends of contact


@stored(digits=10)
def motion(train: Any, state: np.ndarray, periods: int) -> dict[str, Any]:
    """The state at the end of common periods, the number of switches, and what is `Measured`, (meshes,)."""
    oracle = Oracle(train, train.period)
    end = oracle.after(state, periods)
    measured = {f.name: np.array([getattr(m, f.name) for m in oracle.measured]) for f in fields(Measured)}
    return {"end": end, "switched": np.array(oracle.switches), **measured}


class Oracle:
    """The equations of a train; ``period`` in s is the unit in which `after` counts."""

    def __init__(self, train: Any, period: float) -> None:
        self.train, self.period, self.Omega = train, period, train.speed * 2 * np.pi / 60
        self.switches = 0
        self.body = {body.name: body for body in train.bodies}
        self.speed = steady_speeds(train)
        self.index: dict[Any, int] = {}
        for body in train.bodies:
            if body.inertia is not None:
                self.index[body.name, "θ"] = len(self.index)
            held = body.support or body.pin
            for axis in () if held is None else ("x", "y") if held.direction is None else ("d",):
                self.index[body.name, axis] = len(self.index)
        n = len(self.index)
        M, self.D, self.Q0 = np.zeros((n, n)), np.zeros(n), np.zeros(n)
        self.torques = []
        for body in train.bodies:
            if body.inertia is not None:
                i = self.index[body.name, "θ"]
                M[i, i] += body.inertia
                self.D[i], self.Q0[i] = body.damping, body.torque * self.sense(body)
                self.torques += [(i, self.sense(body) * o.amplitude, o.order * self.Omega, o.phase)
                                 for o in body.torque_orders]
            for axis in (0, 1) if body.mass else ():
                row = self.centre(body)[axis]
                M += body.mass * np.outer(row, row)
        self.measured = [Measured() for _ in train.meshes]
        self.inverse, self.M = np.linalg.inv(M), M
        self.springs: list[Spring] = []
        self.contacts = [self._mesh(mesh) for mesh in train.meshes]
        for shaft in train.shafts:
            turn = self.sense(self.body[shaft.between[0]])
            row, prescribed = self._angles({shaft.between[0]: turn, shaft.between[1]: -turn})
            if shaft.stiffness:
                self.springs.append(Spring(shaft.name, row, prescribed, shaft.stiffness, shaft.damping))
            if shaft.stop is not None:
                def stop(*_: float, k: float = shaft.stop_stiffness, gap: float = shaft.stop) -> tuple[float, float]:
                    return k, gap
                self.contacts.append(Contacts(shaft.name, row, prescribed, c=shaft.stop_damping,
                                              flanks=[(1, stop), (-1, stop)],
                                              releases=train.damping_law == "unilateral"))
        for body in train.bodies:
            if held := body.support or body.pin:
                moved = self.centre(body) - (self._place(body) if body.pin else 0.0)
                rows = moved if held.direction is None else [self._unit(held.direction) @ moved]
                self.springs += [Spring(f"{body.name}{i + 1 if i else ''}", row, {}, held.stiffness, held.damping)
                                 for i, row in enumerate(rows)]

    def sense(self, body: Any) -> float:
        return -1.0 if self.speed[body.name] < 0 else 1.0

    @staticmethod
    def _unit(angle: float) -> np.ndarray:
        return np.array([np.cos(angle), np.sin(angle)])

    def centre(self, body: Any) -> np.ndarray:
        """Displacement of a centre, (2, n)."""
        out, held = np.zeros((2, len(self.index))), body.support or body.pin
        if held is not None and held.direction is not None:
            out[:, self.index[body.name, "d"]] = self._unit(held.direction)
        elif held is not None:
            out[0, self.index[body.name, "x"]] = out[1, self.index[body.name, "y"]] = 1.0
        elif body.carrier:
            out = self._place(body)
        return out

    def _place(self, planet: Any) -> np.ndarray:
        """Displacement of the place of a planet in its carrier."""
        carrier = self.body[planet.carrier]
        out = self.centre(carrier).copy()
        if carrier.inertia is not None:
            out[:, self.index[carrier.name, "θ"]] += planet.orbit * self._unit(planet.position + np.pi / 2)
        return out

    def _angles(self, factors: dict[str, float]) -> tuple[np.ndarray, dict[str, float]]:
        row, prescribed = np.zeros(len(self.index)), {}
        for name, factor in factors.items():
            if name != "ground" and self.body[name].inertia is not None:
                row[self.index[name, "θ"]] += factor
            elif name != "ground" and self.body[name].motion is not None:
                prescribed[name] = factor
        return row, prescribed

    def _mesh(self, mesh: Any) -> Contacts:
        (a, b), (ra, rb) = (self.body[name] for name in mesh.between), mesh.base_radii
        planet = a if a.carrier else b if b.carrier else None
        seen = self.speed[planet.carrier] if planet else 0.0
        turns = [1.0 if self.speed[x.name] >= seen else -1.0 for x in (a, b)]
        if self.speed[b.name] == seen:  # by the first wheel
            turns[1] = turns[0] if mesh.internal else -turns[0]
        moving = any(self.centre(x).any() for x in (a, b))
        factors = {a.name: turns[0] * ra, b.name: -turns[1] * rb}
        if planet and not moving:  # the carrier turns under its wheels
            factors[planet.carrier] = factors.get(planet.carrier, 0.0) - turns[0] * ra + turns[1] * rb
        row, prescribed = self._angles(factors)
        if moving:
            row = row + self._pressed(mesh, a, b, planet, turns[0]) @ (self.centre(a) - self.centre(b))
        order = abs(self.speed[a.name] - seen) * mesh.teeth[0]
        error = [(amplitude, (j + 1) * order * self.Omega, (j + 1) * mesh.phase - (
            mesh.error_phases[j] if j < len(mesh.error_phases) else 0.0)) for j, amplitude in
            enumerate(mesh.error_amplitudes)]
        flanks, marks = _tooth_pairs(mesh) if mesh.tooth_pairs is not None else _one_spring(mesh)
        law = mesh.damping_law or self.train.damping_law
        return Contacts(mesh.name, row, prescribed, c=mesh.damping, flanks=flanks, marks=marks, order=order,
                        phase=mesh.phase / (2 * np.pi), always=law == "always", error=error,
                        releases=law == "unilateral")

    def _pressed(self, mesh: Any, a: Any, b: Any, planet: Any, turn: float) -> np.ndarray:
        """The direction of the force of the first wheel on the second one on front flanks."""
        if mesh.line_of_action is not None or not planet:
            return self._unit(mesh.line_of_action or 0.0)
        out, along = self._unit(planet.position), self._unit(planet.position + np.pi / 2)
        cos, sin = np.cos(mesh.pressure_angle), np.sin(mesh.pressure_angle)
        if mesh.internal:  # the planet drives its ring, or is driven by it: they push each other outwards and inwards
            return turn * cos * along + (sin * out if planet is a else -sin * out)
        if planet is a:  # inside, where the sun is, its teeth move the other way
            return -turn * cos * along - sin * out
        return turn * cos * along + sin * out

    def turning(self, w: np.ndarray) -> float:
        """The speed with which all bodies turn as they do steadily, that of the largest coordinate, from q'."""
        as_whole = np.zeros(len(self.index))
        for (name, axis), i in self.index.items():
            if axis == "θ":
                as_whole[i] = self.speed[name]
        for (name, axis), i in self.index.items():
            body = self.body[name]
            if axis != "θ" and body.pin:
                place = self._place(body) @ as_whole
                as_whole[i] = place @ self._unit(body.pin.direction) if axis == "d" else place["xy".index(axis)]
        momentum = as_whole @ self.M
        return momentum @ w[len(as_whole):] / (momentum @ as_whole) * np.abs(as_whole).max()

    def motion(self, element: Spring, t: float) -> tuple[float, float]:
        """The part of a deflection, and of its rate, that does not follow from q."""
        h = rate = 0.0
        for name, factor in element.prescribed.items():
            for o in self.body[name].motion:
                w = o.order * self.Omega
                size = factor * self.sense(self.body[name]) * (
                    o.angle if o.angle is not None else -o.acceleration / w**2)
                h += size * np.cos(w * t + o.phase)
                rate -= size * w * np.sin(w * t + o.phase)
        for amplitude, w, phase in getattr(element, "error", None) or ():
            h -= amplitude * np.cos(w * t + phase)
            rate += amplitude * w * np.sin(w * t + phase)
        return h, rate

    def deflection(self, element: Spring, t: float, w: np.ndarray) -> tuple[float, float]:
        """s and s' in a state (q, q')."""
        n = len(self.index)
        h, rate = self.motion(element, t)
        return element.row @ w[:n] + h, element.row @ w[n:] + rate

    def after(self, w: np.ndarray, periods: int) -> np.ndarray:
        """The state (q, q') after common periods from t = 0."""
        marks = [np.arange(periods + 1) * self.period]
        for element in self.contacts:
            if element.order and element.marks:
                length = 2 * np.pi / (self.Omega * element.order)
                count = int(np.ceil(periods * self.period / length)) + 2
                shares = np.arange(-1, count)[:, None] + np.array(element.marks) - element.phase % 1.0
                marks.append((shares * length).ravel())
        ends = np.unique(np.concatenate(marks))
        ends = ends[(ends > -_SHORT * self.period) & (ends < (periods + _SHORT) * self.period)]
        ends = ends[np.append(True, np.diff(ends) > _SHORT * self.period)]
        for start, end in pairwise(ends):
            w = self._piece(w, start, end)
        return w

    def _piece(self, w: np.ndarray, start: float, end: float) -> np.ndarray:
        """Between two marks, at which contacts keep the form that they have in the middle."""
        piece = _Piece(self, (start + end) / 2)
        t, closed = start, piece.closed(start, w)
        while t < end:
            t, w, closed = piece.follow(t, w, end, closed)
        return w


class _Piece:
    def __init__(self, oracle: Oracle, middle: float) -> None:
        self.oracle, self.n = oracle, len(oracle.index)
        self.flanks = [(m, c, side, form) for m, c in enumerate(oracle.contacts) for side, form in c.flanks]
        self.mesh = np.array([m for m, *_ in self.flanks])
        self.side = np.array([side for _, _, side, _ in self.flanks], float)
        self.rows = np.array([c.row for _, c, _, _ in self.flanks])
        self.c = np.array([c.c for _, c, *_ in self.flanks])
        self.releases = np.array([c.releases for _, c, *_ in self.flanks])
        self.middle = middle
        self.k = np.array([k for k, _ in self._forms(middle)])

    def _forms(self, t: float) -> list[tuple[float, float]]:
        """Stiffness and gap of each contact, with the form that they have in this piece."""
        out = []
        for _, c, _, form in self.flanks:
            middle, share = (c.order * self.oracle.Omega * s / (2 * np.pi) + c.phase for s in (self.middle, t))
            out.append(form(middle % 1.0, share - np.floor(middle)))
        return out

    def offset(self, t: float) -> np.ndarray:
        return np.array([gap for _, gap in self._forms(t)])

    def gap(self, t: float, w: np.ndarray) -> np.ndarray:
        h = np.array([self.oracle.motion(c, t)[0] for c in self.oracle.contacts])
        return self.side * (self.rows @ w[: self.n] + h[self.mesh]) - self.offset(t)

    def gap_rate(self, t: float, w: np.ndarray) -> np.ndarray:
        h = np.array([self.oracle.motion(c, t)[1] for c in self.oracle.contacts])
        d = 1e-4 * self.oracle.period  # parabolas have exact central differences
        return self.side * (self.rows @ w[self.n:] + h[self.mesh]) - (self.offset(t + d) - self.offset(t - d)) / (2 * d)

    def pushes(self, t: float, w: np.ndarray) -> np.ndarray:
        """What of the contacts that release is positive while they push: beside the gap the force."""
        rate = np.array([self.oracle.deflection(c, t, w)[1] for c in self.oracle.contacts])[self.mesh]
        gap = self.gap(t, w)
        return np.minimum(gap, gap + self.c * self.side * rate / np.maximum(self.k, 1e-300))

    def inside(self, t: float, w: np.ndarray, closed: np.ndarray) -> np.ndarray:
        """Positive until a contact switches."""
        return np.where(closed, 1.0, -1.0) * np.where(self.releases, self.pushes(t, w), self.gap(t, w))

    def closed(self, t: float, w: np.ndarray) -> np.ndarray:
        return (self.inside(t, w, np.ones(len(self.k), bool)) > 0) & (self.k > 0)

    def right_side(self, closed: np.ndarray):
        o, n = self.oracle, self.n

        def f(t: float, w: np.ndarray) -> np.ndarray:
            Q = o.Q0 - o.D * w[n:]
            for i, amplitude, frequency, phase in o.torques:
                Q[i] += amplitude * np.cos(frequency * t + phase)
            for spring in o.springs:
                s, v = o.deflection(spring, t, w)
                Q = Q - (spring.k * s + spring.c * v) * spring.row
            force = np.where(closed, self.side * self.k * self.gap(t, w), 0.0)
            Q = Q - force @ self.rows
            for m, c in enumerate(o.contacts):
                if c.c and (c.always or closed[self.mesh == m].any()):
                    Q = Q - c.c * o.deflection(c, t, w)[1] * c.row
            return np.concatenate([w[n:], o.inverse @ Q])
        return f

    def follow(self, t: float, w: np.ndarray, end: float, closed: np.ndarray):
        """Until a contact switches, or to the end."""
        f = self.right_side(closed)
        watched = self.k > 0
        solver = integrator(f, t, w, end)
        while solver.status == "running":
            before, state = solver.t, solver.y.copy()
            solver.step()
            assert solver.status != "failed"
            dense = solver.dense_output()
            left = before
            for right in before + _WATCHED * (solver.t - before):
                wrong = np.flatnonzero(watched & (self.inside(right, dense(right), closed) < 0))
                if len(wrong):
                    found = min(self._zero(dense, left, right, e, closed) for e in wrong)
                    self.oracle.switches += 1
                    self.measure(dense, before, found, closed)
                    return self._at_switch(f, before, state, found, wrong, closed)
                left = right
            self.measure(dense, before, solver.t, closed)
        return solver.t, solver.y, closed

    def force(self, t: float, w: np.ndarray, closed: np.ndarray) -> np.ndarray:
        """The force of each element with contacts."""
        spring = np.where(closed, self.side * self.k * self.gap(t, w), 0.0)
        return np.array([spring[self.mesh == m].sum() + (
            c.c * self.oracle.deflection(c, t, w)[1] if c.always or closed[self.mesh == m].any() else 0.0)
            for m, c in enumerate(self.oracle.contacts)])

    def measure(self, dense: Any, start: float, end: float, closed: np.ndarray) -> None:
        """Add an interval without switches to what is measured."""
        length = end - start
        inside = np.array([self.force(t, dense(t), closed) for t in start + (0.5 + _NODES) * length])
        every = np.array([self.force(t, dense(t), closed) for t in start + _SAMPLED * length])
        for m, out in enumerate(self.oracle.measured):
            own = self.side[(self.mesh == m) & closed]
            out.front_time += length * bool((own > 0).any())
            out.back_time += length * bool((own < 0).any())
            out.force_square += length * float(_WEIGHTS @ inside[:, m] ** 2)
            out.force += length * float(_WEIGHTS @ (inside[:, m] * (np.sign(own.sum()) or 0.0)))
            out.largest, out.smallest = max(out.largest, every[:, m].max()), min(out.smallest, every[:, m].min())

    def _zero(self, dense: Any, left: float, right: float, e: int, closed: np.ndarray) -> float:
        def g(s: float) -> float:
            return self.inside(s, dense(s), closed)[e]
        return left if g(left) <= 0 else brentq(g, left, right, xtol=1e-18, rtol=1e-15)

    def _at_switch(self, f: Any, t: float, w: np.ndarray, found: float, wrong: np.ndarray, closed: np.ndarray):
        """Refine the instant by Newton's method on states that are integrated anew."""
        w = integrate(f, t, w, found)
        e = wrong[np.argmin(np.abs(self.inside(found, w, closed)[wrong]))]
        for _ in range(3):
            value, rate = self.inside(found, w, closed)[e], np.where(closed, 1, -1)[e] * self.gap_rate(found, w)[e]
            if self.releases[e]:
                before = found - 1e-6 * self.oracle.period
                rate = (value - self.inside(before, integrate(f, found, w, before), closed)[e]) / (found - before)
            later = found - value / rate
            w, found = integrate(f, found, w, later), later
        near = ~self.releases & (
            np.abs(self.gap(found, w)) < 1e-12 * max(np.abs(self.rows @ w[: self.n]).max(), 1e-9))
        near[e] = True
        switched = near & (self.k > 0) & (np.sign(self.gap_rate(found, w)) == np.where(closed, -1, 1))
        switched[e] |= self.releases[e]
        after = np.where(switched, ~closed, closed)
        for m, out in enumerate(self.oracle.measured):
            out.switches += int(closed[self.mesh == m].any() != after[self.mesh == m].any())
        return found, w, after


def integrator(f: Any, t: float, w: np.ndarray, end: float) -> DOP853:
    return DOP853(f, t, w, end, rtol=1e-13, atol=1e-18)


def integrate(f: Any, t: float, w: np.ndarray, end: float) -> np.ndarray:
    if t == end:
        return w
    solver = integrator(f, t, w, end)
    while solver.status == "running":
        solver.step()
    return solver.y


def _one_spring(mesh: Any) -> tuple[list[Any], tuple[float, ...]]:
    stepped = hasattr(mesh.stiffness, "levels")
    levels = mesh.stiffness.levels if stepped else (mesh.stiffness,)
    starts = mesh.stiffness.starts if stepped else (0.0,)

    def of(offset: float):
        def form(middle: float, share: float) -> tuple[float, float]:
            return levels[sum(middle >= start for start in starts) - 1], offset  # −1: that of the cycle before
        return form
    return [(1, of(0.0)), (-1, of(mesh.backlash))], tuple(starts) if stepped else ()


def _tooth_pairs(mesh: Any) -> tuple[list[Any], tuple[float, ...]]:
    """Pair j is at x = (share + j)/α on its path, a back flank at 1 − (share + j − back)/α."""
    pairs, alpha, relief = mesh.tooth_pairs, mesh.tooth_pairs.contact_ratio, mesh.tooth_pairs.relief
    amount, length = (relief.amount, relief.length) if relief else ((0.0, 0.0), (0.2, 0.2))
    power = 2 if relief and relief.shape == "parabolic" else 1
    ends = [0.0, 1.0, *pairs.starts, *([1 - length[0]] if amount[0] else []), *([length[1]] if amount[1] else [])]
    flanks: list[Any] = []
    marks = set()
    for side in (1, -1):
        for j in range(4):
            def place(share: float, side: int = side, j: int = j) -> float:
                return (share + j) / alpha if side > 0 else 1 - (share + j - pairs.back_phase) / alpha

            def form(middle: float, share: float, place: Any = place, side: int = side) -> tuple[float, float]:
                here, x = place(middle), place(share)
                k = pairs.stiffness[sum(here >= start for start in pairs.starts) - 1] if 0 < here < 1 else 0.0
                gap = pairs.crowning * (2 * x - 1) ** 2 + (0.0 if side > 0 else mesh.backlash)
                if here > 1 - length[0]:
                    gap += amount[0] * ((x - 1 + length[0]) / length[0]) ** power
                if here < length[1]:
                    gap += amount[1] * ((length[1] - x) / length[1]) ** power
                return k, gap
            flanks.append((side, form))
            marks |= {(x * alpha - j if side > 0 else (1 - x) * alpha + pairs.back_phase - j) % 1.0 for x in ends}
    return flanks, tuple(sorted(marks))


def steady_speeds(train: Any) -> dict[str, float]:
    """Speeds over that of the first body, by least squares from teeth and shafts."""
    names = [body.name for body in train.bodies]
    rows, right = [], []

    def add(factors: dict[str, float], value: float = 0.0) -> None:
        rows.append([factors.get(name, 0.0) for name in names])
        right.append(value)

    add({names[0]: 1.0}, 1.0)
    for body in train.bodies:
        if body.fixed:
            add({body.name: 1.0})
    for shaft in train.shafts:
        a, b = shaft.between
        add({a: 1.0} if b == "ground" else {a: 1.0, b: -1.0})
    carriers = {body.name: body.carrier for body in train.bodies}
    for mesh in train.meshes:
        (a, b), (za, zb) = mesh.between, mesh.teeth
        zb = -zb if mesh.internal else zb
        factors = {a: float(za), b: float(zb)}
        if held := carriers[a] or carriers[b]:
            factors[held] = factors.get(held, 0.0) - za - zb
        add(factors)
    found = np.linalg.lstsq(np.array(rows), np.array(right), rcond=None)[0]
    return {name: 0.0 if abs(v) < 1e-12 else float(v) for name, v in zip(names, found, strict=True)}
