"""The motion of a gear train in all its angles and displacements, by SciPy's DOP853 with located contact switches.

It shares no code with the flow: forces are written from s = r_a φ_a − r_b φ_b − e(t), φ in each wheel's own sense of
rotation, and the equations of the bodies. Trains without planets.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from gearchaos.gears.train.train import Train

_EQUAL = 1e-11  # gaps that are this small beside the backlash when another one vanishes, vanish with it


class Oracle:
    """Integrates q = (angles in own senses, displacements of centres) of the free bodies, and their rates."""

    def __init__(self, train: Train) -> None:
        self.train = train
        self.turn = train.speed * 2 * math.pi / 60
        self.angle = {b.name: i for i, b in enumerate(b for b in train.bodies if b.inertia is not None)}
        self.moved = {b.name: len(self.angle) + i for i, b in enumerate(b for b in train.bodies if b.support)}
        self.n = len(self.angle) + len(self.moved)
        self.bodies = {b.name: b for b in train.bodies}
        speed = {train.bodies[0].name: 1.0}  # magnitudes, by walking through meshes and shafts
        while len(speed) < len(train.bodies):
            for part in (*train.meshes, *train.shafts):
                a, b = part.between
                ratio = part.teeth[0] / part.teeth[1] if hasattr(part, "teeth") else 1.0
                if a in speed and b not in speed:
                    speed[b] = speed[a] * ratio
                elif b in speed and a not in speed:
                    speed[a] = speed[b] / ratio
        self.order = {m.name: speed[m.between[0]] * m.teeth[0] for m in train.meshes}
        self.cycles = {m.name: m.contacts() for m in train.meshes}
        self.contacts: list[tuple[Any, float, int]] = []  # a mesh or the stops of a shaft, side, number of its pair
        for m in train.meshes:
            one = self.cycle(m)
            self.contacts += [(m, side, e) for e, side in enumerate(one.sides.tolist())]
        # a step must not pass over a whole contact
        rates = [math.sqrt(2 * self.cycles[m.name].stiffness.max() * sum(
            r**2 / self.bodies[n].inertia for n, r in zip(m.between, m.base_radii, strict=True)
            if self.bodies[n].inertia)) for m in train.meshes]
        self.longest_step = 0.25 / max(rates)
        self.contacts += [(s, side, 0) for s in train.shafts if s.stop is not None for side in (1.0, -1.0)]

    def cycle(self, mesh: Any) -> Any:
        """Stiffnesses and gaps on the parts of a mesh cycle, as given."""
        return self.cycles[mesh.name]

    def wheel(self, name: str, q: np.ndarray, t: float) -> tuple[float, float]:
        """Angle and rate of a body beside its uniform rotation."""
        body = self.bodies[name]
        if body.inertia is not None:
            return q[self.angle[name]], q[self.n + self.angle[name]]
        value = rate = 0.0
        for each in body.motion or ():
            w = each.order * self.turn
            size = each.angle if each.angle is not None else -each.acceleration / w**2
            value += size * math.cos(w * t + each.phase)
            rate -= size * w * math.sin(w * t + each.phase)
        return value, rate

    def deflection(self, part: Any, q: np.ndarray, t: float) -> tuple[float, float]:
        """s and s' of a mesh, or the twist of a shaft and its rate."""
        a, b = part.between
        (x, v), (y, u) = self.wheel(a, q, t), ((0.0, 0.0) if b == "ground" else self.wheel(b, q, t))
        if not hasattr(part, "teeth"):
            return x - y, v - u
        ra, rb = part.base_radii
        s, rate = ra * x - rb * y, ra * v - rb * u
        for name, sign in ((a, 1.0), (b, -1.0)):
            if name in self.moved:
                along = math.cos((part.line_of_action or 0.0) - self.bodies[name].support.direction)
                s += sign * along * q[self.moved[name]]
                rate += sign * along * q[self.n + self.moved[name]]
        w = self.order[part.name] * self.turn
        for j, e in enumerate(part.error_amplitudes, 1):
            phase = j * (w * t + part.phase) - (part.error_phases[j - 1] if j <= len(part.error_phases) else 0.0)
            s -= e * math.cos(phase)
            rate += e * j * w * math.sin(phase)
        return s, rate

    def gap(self, contact: tuple[Any, float, int], piece: dict, q: np.ndarray, t: float) -> float:
        part, side, e = contact
        s = self.deflection(part, q, t)[0]
        if not hasattr(part, "teeth"):
            return side * s - part.stop
        n, begin = piece[part.name]
        cycles = (t - begin) * self.order[part.name] * self.turn / (2 * math.pi)
        own = self.cycle(part).gap[0, e, n] @ [1.0, cycles, cycles**2]
        return (s if side > 0 else -s - part.backlash) - own

    def rates(self, t: float, q: np.ndarray, closed: Sequence[bool], piece: dict) -> np.ndarray:
        force = np.zeros(self.n)
        mass = np.zeros(self.n)
        for name, i in self.angle.items():
            body = self.bodies[name]
            mass[i] = body.inertia
            force[i] = body.torque - body.damping * q[self.n + i] + sum(
                o.amplitude * math.cos(o.order * self.turn * t + o.phase) for o in body.torque_orders)
        for name, i in self.moved.items():
            body = self.bodies[name]
            mass[i] = body.mass
            force[i] = -body.support.stiffness * q[i] - body.support.damping * q[self.n + i]
        for shaft in self.train.shafts:
            twist, rate = self.deflection(shaft, q, t)
            torque = shaft.stiffness * twist + shaft.damping * rate
            acting = [c for c, on in zip(self.contacts, closed, strict=True) if on and c[0] is shaft]
            for c in acting:
                torque += shaft.stop_stiffness * c[1] * self.gap(c, piece, q, t) + shaft.stop_damping * rate
            for name, sign in zip(shaft.between, (-1.0, 1.0), strict=True):
                if name in self.angle:
                    force[self.angle[name]] += sign * torque
        for mesh in self.train.meshes:
            acting = [c for c, on in zip(self.contacts, closed, strict=True) if on and c[0] is mesh]
            law = mesh.damping_law or self.train.damping_law
            total = mesh.damping * self.deflection(mesh, q, t)[1] if acting or law == "always" else 0.0
            n, _ = piece[mesh.name]
            for c in acting:
                total += self.cycle(mesh).stiffness[0, c[2], n] * c[1] * self.gap(c, piece, q, t)
            for name, radius, sign in zip(mesh.between, mesh.base_radii, (-1.0, 1.0), strict=True):
                if name in self.angle:
                    force[self.angle[name]] += sign * radius * total
                if name in self.moved:
                    along = math.cos((mesh.line_of_action or 0.0) - self.bodies[name].support.direction)
                    force[self.moved[name]] += sign * along * total
        return np.concatenate([q[self.n:], force / mass])

    def pieces(self, duration: float) -> list[tuple[float, float, dict]]:
        """Parts of the time in which no stiffness jumps: begin, end, and of each mesh the part of its cycle with the
        instant when that began."""
        marks = {0.0, duration}
        starts = {}
        for mesh in self.train.meshes:
            rate, edges = self.order[mesh.name] * self.turn / (2 * math.pi), self.cycle(mesh).edges[0]
            phase = mesh.phase / (2 * math.pi) % 1.0
            own = [((k + e - phase) / rate, n) for k in range(-1, int(duration * rate) + 2)
                   for n, e in enumerate(edges)]
            starts[mesh.name] = own
            marks |= {t for t, _ in own if 0 < t < duration}
        times = sorted(marks)
        times = [t for i, t in enumerate(times) if i == 0 or t - times[i - 1] > 1e-13 * duration]
        out = []
        for begin, end in zip(times, [*times[1:], duration], strict=True):
            if end - begin <= 1e-13 * duration:
                continue
            middle = (begin + end) / 2
            piece = {name: max(((t, n) for t, n in own if t <= middle), key=lambda item: item[0])[::-1]
                     for name, own in starts.items()}
            out.append((begin, end, piece))
        return out

    def present(self, contact: tuple[Any, float, int], piece: dict) -> bool:
        part, _, e = contact
        return not hasattr(part, "teeth") or self.cycle(part).stiffness[0, e, piece[part.name][0]] > 0

    def run(self, q: np.ndarray, duration: float) -> np.ndarray:
        """The state after ``duration``, s, from one at t = 0."""
        for begin, end, piece in self.pieces(duration):
            t = begin
            on = [self.present(c, piece) for c in self.contacts]
            closed = [p and self.gap(c, piece, q, t) > 0 for c, p in zip(self.contacts, on, strict=True)]
            while t < end:
                events = []
                for c, shut, there in zip(self.contacts, closed, on, strict=True):
                    def inside(t: float, q: np.ndarray, c: Any = c, shut: bool = shut, there: bool = there,
                               piece: dict = piece) -> float:
                        return (1.0 if shut else -1.0) * self.gap(c, piece, q, t) / self.unit(c) if there else 1.0
                    inside.terminal, inside.direction = True, -1  # type: ignore[attr-defined]
                    events.append(inside)
                found = solve_ivp(lambda t, q, shut=tuple(closed), piece=piece: self.rates(t, q, shut, piece),
                                  (t, end), q, "DOP853", rtol=2.5e-14, atol=1e-17, events=events,
                                  max_step=self.longest_step)
                q, t = found.y[:, -1], found.t[-1]
                if found.status != 1:
                    break
                crossed = next(c for c, times in zip(self.contacts, found.t_events, strict=True) if len(times))
                for e, c in enumerate(self.contacts):  # with those of the same flank and gap
                    same = c[:2] == crossed[:2] and on[e]
                    if c is crossed or (same and abs(self.gap(c, piece, q, t)) < _EQUAL * self.unit(c)):
                        closed[e] = not closed[e]
        return q

    def unit(self, contact: tuple[Any, float, int]) -> float:
        return max(getattr(contact[0], "backlash", None) or getattr(contact[0], "stop", None) or 1e-5, 1e-6)
