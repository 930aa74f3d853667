"""The equations of a train: rows of its springs and meshes, the smallest coordinates, and the switched affine system.

Angles and displacements of centres are deviations q from the steady rotation, in SI, of the n that are free to move.
An element, a spring or a mesh, has a row: its deflection is row·q + h(t), where h has the prescribed motions and, for a
mesh, the error. Deflections are the coordinates: those of the meshes first, then those of springs that do not follow
from them. Turning as a whole, which deflects nothing, is left out, but for its speed where bearings damp it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from gearchaos.errors import InputError
from gearchaos.gears.train.mesh import Mesh
from gearchaos.gears.train.parts import GROUND, Body, Support, Units
from gearchaos.gears.train.teeth import uneven_contacts
from gearchaos.gears.units import RPM
from gearchaos.model.contacts import MeshContacts, OneSidedContacts
from gearchaos.model.switched import SwitchedAffine
from gearchaos.quantities import parameter_owner

Train = Any
"""A `Train`, whose module checks its trains by this one."""

_RANK = 1e-9  # relative size of what is left of a row that depends on others
_SAME = 1e-9  # relative difference of instants and errors that coincide
_SMALLEST_LENGTH = 1e-6  # unit of length where no mesh has backlash, m
_MOST_CONTACTS = 62  # a set of closed contacts is a whole number with a bit for each

Value = Callable[[str, str, float], np.ndarray]
"""A parameter of a part, by the name of that, its field, and the value of the train: (P,)."""


@dataclass(frozen=True, eq=False)
class Element:
    """A spring, a mesh or the stops of a shaft: its deflection is row·q + Σ prescribed[body] φ_body(t) − error."""

    name: str
    row: np.ndarray  # (n,)
    prescribed: dict[str, float]  # factors of the angles of bodies whose motion is prescribed
    owner: str = ""  # the part whose parameters are its stiffness and damping
    stiffness: float = 0.0
    damping: float = 0.0
    backlash: float = 0.0
    mesh: Mesh | None = None
    stops: bool = False

    @property
    def contact(self) -> bool:
        """Whether it pushes in contact alone."""
        return self.mesh is not None or self.stops


class Structure:
    """What of a train does not depend on the values that can be varied: its elements and coordinates."""

    def __init__(self, train: Train) -> None:
        self.train = train
        self.free = [body for body in train.bodies if not body.prescribed]
        self.index: dict[tuple[str, str], int] = {}
        for body in self.free:
            self.index[body.name, "angle"] = len(self.index)
        for body in train.bodies:
            for axis in self._own_axes(body):
                self.index[body.name, axis] = len(self.index)
        self.contacts = [self._mesh(mesh) for mesh in train.meshes]
        self.springs: list[Element] = []
        for shaft in train.shafts:
            sense = self.sense(shaft.between[0])  # twist in the sense in which the shaft turns
            row, prescribed = self._angles(dict(zip(shaft.between, (sense, -sense), strict=True)))
            if shaft.stiffness:
                self.springs.append(Element(shaft.name, row, prescribed, shaft.name, shaft.stiffness, shaft.damping))
            if shaft.stop is not None:
                self.contacts.append(Element(shaft.name, row, prescribed, shaft.name, shaft.stop_stiffness,
                                             shaft.stop_damping, 2 * shaft.stop, stops=True))
        for body in train.bodies:
            self.springs.extend(self._supports(body))
        self._choose()

    def _own_axes(self, body: Body) -> tuple[str, ...]:
        """The axes along which the centre of a body moves by itself."""
        held = body.support or body.pin
        return () if held is None else ("along",) if held.direction is not None else ("x", "y")

    def centre(self, body: Body) -> np.ndarray:
        """The displacement of the centre of a body from q, (2, n)."""
        out = np.zeros((2, len(self.index)))
        axes = self._own_axes(body)
        if axes == ("along",):
            held: Any = body.support or body.pin
            out[:, self.index[body.name, "along"]] = np.cos(held.direction), np.sin(held.direction)
        elif axes:
            out[0, self.index[body.name, "x"]] = out[1, self.index[body.name, "y"]] = 1.0
        elif body.carrier is not None:
            out = self._on_carrier(body)
        return out

    def _on_carrier(self, planet: Body) -> np.ndarray:
        """The displacement of the place of a planet on its carrier from q, (2, n)."""
        carrier = self.train.body(str(planet.carrier))
        out = self.centre(carrier).copy()
        if not carrier.prescribed:
            tangent = -np.sin(planet.position), np.cos(planet.position)
            out[:, self.index[carrier.name, "angle"]] += planet.orbit * np.array(tangent)
        return out

    def _angles(self, factors: dict[str, float]) -> tuple[np.ndarray, dict[str, float]]:
        """A row from factors of angles by body, and those of the bodies whose motion is prescribed."""
        row, prescribed = np.zeros(len(self.index)), dict[str, float]()
        for name, factor in factors.items():
            if name == GROUND or self.train.body(name).fixed:
                continue
            if self.train.body(name).prescribed:
                prescribed[name] = prescribed.get(name, 0.0) + factor
            else:
                row[self.index[name, "angle"]] += factor
        return row, prescribed

    def _mesh(self, mesh: Mesh) -> Element:
        """s = r_a φ_a − r_b φ_b − e + half the backlash, φ in the sense in which each wheel turns in the mesh."""
        train, (a, b), (ra, rb) = self.train, map(self.train.body, mesh.between), mesh.base_radii
        held = train.carrier(mesh)
        sense = 1.0 if train.ratios[a.name] >= (train.ratios[held] if held else 0) else -1.0
        other = -rb if mesh.internal else rb
        factors = {a.name: sense * ra, b.name: sense * other}
        normal = np.zeros(2)
        if any(self.centre(body).any() for body in (a, b)):
            direction = mesh.line_of_action or 0.0
            if held and mesh.line_of_action is None and mesh.pressure_angle is not None:
                planet = a if a.carrier else b
                # seen from the carrier, the front flanks of the first wheel push towards where its teeth move, those
                # of a planet at its sun against its own sense; they push wheels apart, and planet and ring together
                along = -sense if planet is a and not mesh.internal else sense
                outwards = 1.0 if (planet is a) == mesh.internal else -1.0
                direction = planet.position + along * (np.pi / 2 - outwards * mesh.pressure_angle)
            normal = np.array([np.cos(direction), np.sin(direction)])
        elif held:  # the carrier is prescribed or held: no centre moves
            factors[held] = factors.get(held, 0.0) - sense * (ra + other)
        row, prescribed = self._angles(factors)
        row = row + normal @ (self.centre(a) - self.centre(b))
        return Element(mesh.name, row, prescribed, mesh.name, damping=mesh.damping, backlash=mesh.backlash, mesh=mesh)

    def _supports(self, body: Body) -> list[Element]:
        """The springs of a support, or of the pin of a planet in its carrier."""
        held: Support | None = body.support or body.pin
        if held is None:
            return []
        moved = self.centre(body) - (self._on_carrier(body) if body.pin else 0.0)
        rows = moved if held.direction is None else np.array([[np.cos(held.direction), np.sin(held.direction)]]) @ moved
        return [Element(body.name, row, {}, "", held.stiffness, held.damping) for row in rows]

    def _choose(self) -> None:
        """Choose the coordinates: independent rows, and the motions that deflect nothing."""
        elements = [*self.contacts, *self.springs]
        weight = 1 / np.sqrt(np.diag(self.mass(as_given)[0]))
        basis = np.zeros((0, len(weight)))
        self.chosen: list[Element] = []
        for element in elements:
            row = element.row * weight
            left = row - basis.T @ (basis @ row)
            left -= basis.T @ (basis @ left)
            if np.linalg.norm(left) > _RANK * np.linalg.norm(row):
                basis = np.vstack([basis, left / np.linalg.norm(left)])
                self.chosen.append(element)
        self.S = np.array([element.row for element in self.chosen])
        _, _, v = np.linalg.svd(self.S)
        free = v[len(self.S):].T
        radius = self.train.meshes[0].base_radii[0]
        forward = np.where(free[:1] < 0, -1.0, 1.0)  # the first body in its own sense
        self.rigid = forward * free / np.abs(free).max(axis=0, initial=0.0) / radius  # (n, n - r)
        damped = any(body.damping for body in self.free)
        self.kept = self.rigid if damped else self.rigid[:, :0]
        self.names = tuple(name for element in self.chosen for name in self.coordinate(element)) + tuple(
            f"rotation{i or ''}_dot" for i in range(self.kept.shape[1]))

    def coordinate(self, element: Element) -> tuple[str, str]:
        """The names of a deflection and its rate; those of the first mesh are z and z_dot."""
        if element is self.contacts[0]:
            return "z", "z_dot"
        owner = parameter_owner(element.name)
        # of a support the number says along which axis, whether the other one is chosen or not
        number = [each for each in (*self.contacts, *self.springs) if each.name == element.name].index(element)
        owner += str(number + 1) if number else ""
        return f"{owner}.z", f"{owner}.z_dot"

    def mass(self, value: Value) -> np.ndarray:
        """The mass matrix (P, n, n)."""
        size = len(self.index)
        inertia = {body.name: value(body.name, "inertia", body.inertia) for body in self.free}
        out = np.zeros((max((len(v) for v in inertia.values()), default=1), size, size))
        for body in self.train.bodies:
            if not body.prescribed:
                i = self.index[body.name, "angle"]
                out[:, i, i] += inertia[body.name]
            if body.mass is not None:
                moved = self.centre(body)
                out += body.mass * moved.T @ moved
        return out

    def torques(self, value: Value) -> np.ndarray:
        """Mean generalised forces (P, n)."""
        given = {body.name: value(body.name, "torque", self.train.torque_of(body)) for body in self.free}
        out = np.zeros((max((len(v) for v in given.values()), default=1), len(self.index)))
        for name, torque in given.items():
            out[:, self.index[name, "angle"]] = torque * self.sense(name)
        return out

    def imbalance(self, value: Value) -> tuple[np.ndarray, np.ndarray]:
        """The mean torque left over in each motion that deflects nothing, and the sum of the magnitudes of all, each
        (P, n − r)."""
        torques = self.torques(value)
        return torques @ self.rigid, np.abs(torques) @ np.abs(self.rigid)

    def sense(self, name: str) -> float:
        """1 or −1: the sense in which a body turns."""
        return 1.0 if self.train.ratios[name] >= 0 else -1.0

    def ground_damping(self, value: Value) -> np.ndarray:
        """Damping of the angles to the housing, (P, n): the diagonal of a matrix."""
        given = {body.name: value(body.name, "damping", body.damping) for body in self.free}
        out = np.zeros((max((len(v) for v in given.values()), default=1), len(self.index)))
        for name, damping in given.items():
            out[:, self.index[name, "angle"]] = damping
        return out

    @cached_property
    def orders(self) -> np.ndarray:
        """Orders of all excitations of the forcing as multiples of the common one, ascending, (H,) int."""
        train, base = self.train, self.train.base_order
        found = {each.ratio for body in train.bodies for each in (*(body.motion or ()), *body.torque_orders)}
        for mesh in train.meshes:
            found |= {train.turn_order(mesh, i) for i, length in enumerate(mesh.eccentricity) if length}
            found |= {(j + 1) * train.mesh_order(mesh) for j, e in enumerate(mesh.error_amplitudes) if e}
        return np.array(sorted(int(order / base) for order in found if order), dtype=np.int64)

    def _at(self, order: Any) -> int:
        return int(np.searchsorted(self.orders, int(order / self.train.base_order)))

    def torque_harmonics(self) -> np.ndarray:
        """Complex amplitudes of the generalised forces at the orders, (H, n): the real part of each × exp(i order)."""
        out = np.zeros((len(self.orders), len(self.index)), complex)
        for body in self.free:
            for each in body.torque_orders:
                out[self._at(each.ratio), self.index[body.name, "angle"]] += (
                    self.sense(body.name) * each.amplitude * np.exp(1j * each.phase))
        return out

    def deflection_harmonics(self, element: Element, speed: np.ndarray) -> np.ndarray:
        """Complex amplitudes (P, H) of h(t), the prescribed part of a deflection; ``speed`` (P,) of body 1, rad/s."""
        out = np.zeros((len(speed), len(self.orders)), complex)
        for name, factor in element.prescribed.items():
            for each in self.train.body(name).motion:
                size = each.angle if each.angle is not None else (
                    -each.acceleration / (each.order * speed) ** 2)
                out[:, self._at(each.ratio)] += factor * self.sense(name) * size * np.exp(1j * each.phase)
        if (mesh := element.mesh) is None:
            return out
        for i, length in enumerate(mesh.eccentricity):
            if length:
                angle = mesh.phase / mesh.teeth[i] - mesh.eccentricity_phases[i]
                out[:, self._at(self.train.turn_order(mesh, i))] -= length * np.exp(1j * angle)
        for j, amplitude in enumerate(mesh.error_amplitudes):
            if amplitude and (order := (j + 1) * self.train.mesh_order(mesh)):
                theta = mesh.error_phases[j] if j < len(mesh.error_phases) else 0.0
                out[:, self._at(order)] -= amplitude * np.exp(1j * ((j + 1) * mesh.phase - theta))
        return out


def as_given(owner: str, name: str, given: float) -> np.ndarray:
    """The value that the train has."""
    return np.array([given], dtype=float)


@lru_cache(maxsize=64)
def structure(train: Train) -> Structure:
    """The structure of a train."""
    return Structure(train)


def mean_imbalance(train: Train) -> tuple[float, float, str]:
    """The mean torque that is left over where the train turns as a whole, N m at a body, the sum of the magnitudes of
    all, and that body: the last one with a torque, or the last one."""
    found = structure(train)
    for mode, (left,), (size,) in zip(found.rigid.T, *(each.T for each in found.imbalance(as_given)), strict=True):
        moved = [body for body in found.free if abs(mode[found.index[body.name, "angle"]]) > _RANK]
        if abs(left) > 0 and moved:
            body = [each for each in moved if train.torque_of(each)][-1]
            share = abs(mode[found.index[body.name, "angle"]])
            sign = np.sign(mode[found.index[body.name, "angle"]]) * found.sense(body.name)
            return float(sign * left / share), float(size / share), body.name
    return 0.0, 1.0, ""


def balancing_speeds(train: Train) -> list[float]:
    """The speeds of the first body, rpm, at which the mean torques balance where some depend on the speed: the roots of
    what is left over, which is linear between the speeds of the tables."""
    found, tables = structure(train), [np.array(body.torque_over_speed.speed) / abs(float(train.ratios[body.name]))
                                       for body in train.bodies if body.torque_over_speed and train.ratios[body.name]]
    if not tables:
        return []
    low, high = max(each[0] for each in tables), min(each[-1] for each in tables)
    knots = np.unique(np.clip(np.concatenate(tables), low, high))

    def torque(name: str, _: str, own: Any) -> Any:
        body = train.body(name)
        return np.full(len(knots), own) if body.torque_over_speed is None else train.torque_at(body, knots)

    left, _ = found.imbalance(torque)  # (knots, motions)
    start, stop = left[:-1, 0], left[1:, 0]
    crossed = (start * stop <= 0) & (start != stop)
    roots = (knots[:-1] + np.diff(knots) * start / np.where(crossed, start - stop, 1.0))[crossed]
    return [speed for speed in np.unique(roots).tolist() if all(
        abs(np.interp(speed, knots, each)) <= 1e-9 * np.abs(each).max(initial=1e-300) for each in left.T)]


class Assembly:
    """The arrays of a train at P points, whose values ``value`` gives; ``speed`` (P,) in rpm.

    The units are those of the train as given: half the first backlash, the frequency of the first mesh with the mean of
    its stiffness, and the product of that stiffness and that length. A state w has r deflections, each before its rate,
    then the kept speeds of turning as a whole.
    """

    def __init__(self, found: Structure, units: Units, value: Value, speed: np.ndarray) -> None:
        self.found, self.units, self.value, self.speed = found, units, value, speed * RPM
        self.points, r = len(speed), len(found.S)
        self.at = 2 * np.arange(r)  # of deflections in w
        self.place = np.concatenate([self.at + 1, np.arange(2 * r, len(found.names))])  # of rates and kept speeds

    def _of(self, values: np.ndarray) -> np.ndarray:
        return np.broadcast_to(values, (self.points, *values.shape[1:]))

    @cached_property
    def mass(self) -> np.ndarray:
        """The mass matrix (P, n, n)."""
        return self._of(self.found.mass(self.value))

    @cached_property
    def from_speeds(self) -> np.ndarray:
        """q' from the rates of the chosen deflections and the kept speeds of turning, (P, n, r + k)."""
        found = self.found
        momentum = np.einsum("nk,pnm->pkm", found.rigid, self.mass)
        scaled = momentum / np.einsum("pkm,mk->pk", momentum, found.rigid)[:, :, None]
        both = np.concatenate([np.broadcast_to(found.S, (self.points, *found.S.shape)), scaled], axis=1)
        return np.linalg.inv(both)[:, :, : len(self.place)]

    @cached_property
    def to_speeds(self) -> np.ndarray:
        """Accelerations of the chosen deflections, and of the kept turning, from forces, (P, r + k, n)."""
        found = self.found
        turn = np.einsum("nk,pnm->pkm", found.kept, self.mass)
        turned = found.kept.T[None] / np.einsum("pkm,mk->pk", turn, found.kept)[:, :, None]
        return np.concatenate([np.einsum("rn,pnm->prm", found.S, np.linalg.inv(self.mass)), turned], axis=1)

    @cached_property
    def chosen_harmonics(self) -> np.ndarray:
        """Complex amplitudes of the prescribed parts of the chosen deflections, (P, r, H)."""
        return np.stack([self.found.deflection_harmonics(e, self.speed) for e in self.found.chosen], axis=1)

    @cached_property
    def frequencies(self) -> np.ndarray:
        """Those of the harmonics, (P, H), rad/s."""
        return self.found.orders * self.omega[:, None] * self.units.rate

    @cached_property
    def omega(self) -> np.ndarray:
        """The frequency of the common period over the unit of frequency, (P,)."""
        return float(self.found.train.base_order) * self.speed / self.units.rate

    @cached_property
    def middle(self) -> np.ndarray:
        """The chosen deflections s midway between their flanks, with the sign reversed, (P, r)."""
        halves = [self.backlash(e) / 2 if e.mesh is not None else np.zeros(self.points) for e in self.found.chosen]
        return np.stack(halves, axis=1)

    def coefficients(self, element: Element) -> np.ndarray:
        """The deflection of an element from the chosen ones, (r,), but for its prescribed part."""
        if element in self.found.chosen:
            return np.eye(len(self.found.S))[self.found.chosen.index(element)]
        c = np.linalg.lstsq(self.found.S.T, element.row, rcond=None)[0]
        return np.where(np.abs(c) < _RANK * np.abs(c).max(), 0.0, c)

    def _own_harmonics(self, element: Element) -> np.ndarray:
        """What is prescribed of the deflection of an element beside what the chosen ones say, (P, H), complex."""
        followed = np.einsum("r,prh->ph", self.coefficients(element), self.chosen_harmonics)
        return self.found.deflection_harmonics(element, self.speed) - followed

    def stiffness(self, element: Element) -> np.ndarray:
        """Mean stiffness of an element, (P,)."""
        mean = mean_stiffness(element)
        return self._of(self.value(element.owner, "stop_stiffness" if element.stops else "stiffness", mean))

    def damping(self, element: Element) -> np.ndarray:
        """Damping coefficient of an element, (P,)."""
        return self._of(self.value(element.owner, "stop_damping" if element.stops else "damping", element.damping))

    def backlash(self, element: Element) -> np.ndarray:
        """The play of a mesh, or between stops, (P,)."""
        if element.stops:
            return 2 * self._of(self.value(element.owner, "stop", element.backlash / 2))
        return self._of(self.value(element.owner, "backlash", element.backlash))

    def system(self) -> SwitchedAffine:
        """The switched affine system, in the units of the train."""
        found, units, points, at, d = self.found, self.units, self.points, self.at, len(self.found.names)
        A, f0, harmonics = self._without_elements()
        for spring in found.springs:
            self._add_spring(spring, A, f0, harmonics)
        rows, pushes, offsets = self._flanks()
        rates = np.roll(rows, 1, axis=1)  # the rate of a deflection follows it
        damping = np.stack([self.damping(element) for element in found.contacts], axis=1)
        in_contact = np.array([element.mesh is None or (element.mesh.damping_law or found.train.damping_law) != "always"
                               for element in found.contacts])
        A -= np.einsum("pki,pk,kj->pij", pushes, damping * ~in_contact, rates)
        size = np.full(d, units.length * units.rate)
        size[at] = units.length
        harmonics = harmonics / (size * units.rate)
        made = MeshContacts(
            names=tuple(element.name for element in found.contacts), front=offsets[0, :, 0] / units.length,
            rows=rows, rates=rates, pushes=pushes * units.force / (size * units.rate),
            damping=damping * units.rate / units.stiffness, in_contact=in_contact, orders=found.orders,
            f_cos=harmonics.real, f_sin=-harmonics.imag, **self._contacts(offsets))
        none, flat, over_time = np.zeros(points), np.zeros((points, 0)), np.zeros((points, len(found.orders)))
        return SwitchedAffine(
            names=found.names, omega=self.omega, A=A * size / size[:, None] / units.rate, b=made.pushes[:, 0],
            f0=f0 / (size * units.rate), f_cos=made.f_cos[:, :, 1], f_sin=made.f_sin[:, :, 1],
            levels=np.ones((points, 2)), starts=np.array([[0.0, 0.5]] * points), same_starts=True,
            chi_cos=flat, chi_sin=flat, velocity=np.tile(np.eye(d)[1], (points, 1)), velocity0=none,
            velocity_cos=over_time, velocity_sin=over_time, mean_velocity=none, rotation_decay=none,
            damping=made.damping[:, 0], damping_law="contact" if in_contact.any() else "always",
            static_force=self.static[:, : len(rows)] / units.force, contacts=made)

    def _without_elements(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Linear part (P, d, d), constant forcing (P, d) and complex amplitudes of the harmonic forcing (P, H, d), in
        SI, without springs and meshes: torques, prescribed motions, errors, and the damping of bodies."""
        found, d, place = self.found, len(self.found.names), self.place
        A, f0 = np.zeros((self.points, d, d)), np.zeros((self.points, d))
        harmonics = np.zeros((self.points, len(found.orders), d), complex)
        A[:, self.at, self.at + 1] = 1.0
        f0[:, place] = np.einsum("pvn,pn->pv", self.to_speeds, self._of(found.torques(self.value)))
        harmonics[:, :, place] = np.einsum("pvn,hn->phv", self.to_speeds, found.torque_harmonics())
        w, chosen = self.frequencies[:, None, :], self.chosen_harmonics
        harmonics[:, :, self.at + 1] -= (w**2 * chosen).transpose(0, 2, 1)
        dampers = self._of(found.ground_damping(self.value))  # of q', which has no prescribed part
        drag = -np.einsum("pvn,pn,pnu->pvu", self.to_speeds, dampers, self.from_speeds)
        A[:, place[:, None], place] += drag
        harmonics[:, :, place] -= np.einsum("pvr,prh->phv", drag[:, :, : len(self.at)], 1j * w * chosen)
        return A, f0, harmonics

    def _add_spring(self, spring: Element, A: np.ndarray, f0: np.ndarray, harmonics: np.ndarray) -> None:
        """Add the force of a spring and its damper to the arrays of `_without_elements`."""
        c, k, damping, place = self.coefficients(spring), self.stiffness(spring), self.damping(spring), self.place
        pull = np.einsum("pvn,n->pv", self.to_speeds, spring.row)
        A[:, place[:, None], self.at] -= (k[:, None] * pull)[:, :, None] * c
        A[:, place[:, None], self.at + 1] -= (damping[:, None] * pull)[:, :, None] * c
        f0[:, place] += pull * (k * (self.middle @ c))[:, None]
        force = (k[:, None] + 1j * self.frequencies * damping[:, None]) * self._own_harmonics(spring)
        harmonics[:, :, place] -= np.einsum("ph,pv->phv", force, pull)

    def _flanks(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of all contacts the rows (K, d), the pushes (P, K, d), and the offsets of both flanks (P, K, 2), in SI."""
        found, count = self.found, len(self.found.contacts)
        rows, pushes = np.zeros((count, len(found.names))), np.zeros((self.points, count, len(found.names)))
        offsets = np.zeros((self.points, count, 2))
        most = _SAME * np.abs(self.chosen_harmonics).max(initial=1e-290)
        for m, element in enumerate(found.contacts):
            if np.abs(self._own_harmonics(element)).max(initial=0.0) > most:
                raise InputError(f"mesh {element.name}: error_amplitudes",
                                 "must leave the flanks of a closed loop together", "errors that do not",
                                 "Where meshes form a loop, as in a planetary set, an error of one must be that of the "
                                 "others: give errors only to meshes outside of loops.")
            rows[m, self.at] = self.coefficients(element)
            pushes[:, m, self.place] = np.einsum("pvn,n->pv", self.to_speeds, element.row)
            front = self.middle @ rows[m, self.at] + (self.backlash(element) / 2 if element.stops else 0.0)
            offsets[:, m] = np.stack([front, self.backlash(element) - front], axis=1)
        return rows, pushes, offsets

    def mesh_rotation(self, w: np.ndarray, share: np.ndarray, mesh: int) -> np.ndarray:
        """R1 φ1 − R2 φ2 of a mesh along its line of action, (S,), in states w (S, d) of one point at shares (S,) of the
        period, in units of length; 0 where the front flanks touch without error."""
        element, angles = self.found.contacts[mesh], [axis == "angle" for _, axis in self.found.index]
        turning = Element(f"{element.name}, turning", element.row * angles, element.prescribed)
        c = self.coefficients(turning)
        turns = np.exp(2j * np.pi * self.found.orders * share[:, None])
        prescribed = (turns @ self._own_harmonics(turning)[0]).real - self.middle[0] @ c
        return w[:, self.at] @ c + prescribed / self.units.length

    @cached_property
    def static(self) -> np.ndarray:
        """Mean forces of all contacts and springs under the mean torques, (P, E), negative on a back flank.

        Where meshes close a loop, they share the load by their mean stiffnesses.
        """
        elements = [*self.found.contacts, *self.found.springs]
        rows = np.array([element.row for element in elements])
        k = np.stack([self.stiffness(element) for element in elements], axis=1)
        total = np.einsum("en,pe,em->pnm", rows, k, rows)
        q = np.einsum("pnm,pm->pn", np.linalg.pinv(total, rcond=1e-12, hermitian=True),
                      self._of(self.found.torques(self.value)))
        return k * (q @ rows.T)

    def prescribed_rates(self) -> np.ndarray:
        """The prescribed parts of the rates of the deflections at the phase 0, in states (P, d)."""
        out = np.zeros((self.points, len(self.found.names)))
        rates = 1j * self.frequencies[:, None, :] * self.chosen_harmonics
        out[:, self.at + 1] = rates.real.sum(axis=2) / (self.units.length * self.units.rate)
        return out

    def at_rest(self) -> np.ndarray:
        """The states (P, d) without speed, with the deflections under the mean torques at the phase 0."""
        w, elements = np.zeros((self.points, len(self.found.names))), [*self.found.contacts, *self.found.springs]
        for i, element in zip(self.at, self.found.chosen, strict=True):
            force = self.static[:, elements.index(element)]
            if element.contact:
                side = np.where(force < 0, -1.0, 1.0)
                w[:, i] = side * self.backlash(element) / 2 + force / self._at_start(element, side)
            else:
                w[:, i] = force / self.stiffness(element)
        return w / self.units.length

    def _at_start(self, element: Element, side: np.ndarray) -> np.ndarray:
        """The stiffness of a flank (P,), 1 or −1, at the phase 0."""
        part = self._over_period(element)
        first = np.array([part.stiffness[0][part.sides == s, 0].sum() for s in (1, -1)])
        first = np.where(first > 0, first, mean_stiffness(element))  # where the first teeth are missing
        return np.where(side > 0, *first) * self.stiffness(element) / mean_stiffness(element)

    def _contacts(self, offsets: np.ndarray) -> dict[str, Any]:
        """The contacts of all meshes on the pieces of the common period; ``offsets`` (P, K, 2) in m, of the flanks."""
        parts = [self._over_period(element) for element in self.found.contacts]
        if (count := sum(len(part.sides) for part in parts)) > _MOST_CONTACTS:
            most = max(zip(parts, self.found.contacts, strict=True), key=lambda each: len(each[0].sides))
            raise InputError(
                "meshes", f"must have at most {_MOST_CONTACTS} tooth pairs and stops that may touch, of both flanks",
                count, f"{most[1].name} alone has {len(most[0].sides)}. Without corner contact tooth pairs are fewer, "
                "and a mesh with the stiffness of all pairs together has two.")
        edges = _merged([part.edges[0] for part in parts])
        length = np.diff(edges, append=1.0)
        stiffness, offset, meshes, sides = [], [], [], []
        for m, (element, part) in enumerate(zip(self.found.contacts, parts, strict=True)):
            piece = np.searchsorted(part.edges[0], edges + length / 2, side="right") - 1
            begun = edges - part.edges[0][piece]
            a, b, c = (part.gap[0][:, piece, k] for k in range(3))
            gap = np.stack([a + begun * (b + begun * c), b + 2 * begun * c, c], axis=-1)  # (M, N, 3)
            scale = self.stiffness(element) / (mean_stiffness(element) * self.units.stiffness)
            stiffness.append(part.stiffness[0][:, piece] * scale[:, None, None])
            flank = offsets[:, m, np.where(part.sides > 0, 0, 1)]  # (P, M)
            full = np.broadcast_to(gap, (self.points, *gap.shape)).copy()
            full[..., 0] += flank[:, :, None]
            offset.append(full / self.units.length)
            meshes += [m] * len(part.sides)
            sides.append(part.sides)
        return {"edges": np.broadcast_to(edges, (self.points, len(edges))), "meshes": np.array(meshes),
                "sides": np.concatenate(sides), "stiffness": np.concatenate(stiffness, axis=1),
                "offset": np.concatenate(offset, axis=1)}

    def _over_period(self, element: Element) -> OneSidedContacts:
        """The contacts of an element on the common period, in N/m and m."""
        cycles, phase = self._cycles(element)
        part = _over_period(cycle(element), cycles, phase)
        uneven = element.mesh is not None and element.mesh.uneven
        return uneven_contacts(element.mesh, part, cycles) if uneven else part

    def _cycles(self, element: Element) -> tuple[int, float]:
        """Cycles of a mesh in the common period, and its phase at the start as a share of a cycle."""
        mesh, train = element.mesh, self.found.train
        if mesh is None or mesh.constant:
            return 1, 0.0
        return int(train.mesh_order(mesh) / train.base_order), mesh.phase / (2 * np.pi) % 1.0


def cycle(element: Element) -> OneSidedContacts:
    """The contacts of one mesh cycle, in N/m and m; of stops in N m/rad and rad."""
    if element.mesh is not None:
        return element.mesh.contacts()
    return OneSidedContacts(np.array([1, -1]), np.zeros(2, int), np.zeros((1, 1)),
                            np.full((1, 2, 1), element.stiffness), np.zeros((1, 2, 1, 3)))


@lru_cache(maxsize=256)
def _mean_of(mesh: Mesh) -> float:
    found = mesh.contacts(on_path=True)
    length = np.diff(found.edges[0], append=1.0)
    return float(found.stiffness[0][found.sides > 0].sum(axis=0) @ length)


def mean_stiffness(element: Element) -> float:
    """The stiffness of an element, the mean of a mesh over its cycle on its path without gaps."""
    return element.stiffness if element.mesh is None else _mean_of(element.mesh)


def _over_period(one: OneSidedContacts, cycles: int, phase: float) -> OneSidedContacts:
    """The contacts of one mesh cycle on the common period of several cycles, which begins at a phase of the cycle."""
    starts = (one.edges[0][None, :] + np.arange(-1, cycles + 1)[:, None] - phase).ravel() / cycles
    piece = np.tile(np.arange(one.edges.shape[1]), cycles + 2)
    ends = np.append(starts[1:], np.inf)
    inside = (ends > _SAME / cycles) & (starts < 1 - _SAME / cycles)
    starts, piece = starts[inside], piece[inside]
    begun = np.maximum(-starts, 0.0)
    factors = np.array([1.0, cycles, cycles**2])
    a, b, c = (one.gap[0][:, piece, k] * factors[k] for k in range(3))
    gap = np.stack([a + begun * (b + begun * c), b + 2 * begun * c, c], axis=-1)
    return one._replace(edges=np.maximum(starts, 0.0)[None], stiffness=one.stiffness[:, :, piece], gap=gap[None])


def _merged(edges: list[np.ndarray]) -> np.ndarray:
    """All instants of several lists in order, those that coincide once."""
    every = np.unique(np.concatenate(edges))
    return every[np.append(True, np.diff(every) > 1e-12)]


def units_of(train: Train) -> Units:
    """The units of a train."""
    found = structure(train)
    first = found.contacts[0]
    length = next((mesh.backlash / 2 for mesh in train.meshes if mesh.backlash), _SMALLEST_LENGTH)
    stiffness = mean_stiffness(first)
    inverse = np.linalg.inv(found.mass(as_given)[0])
    return Units(length, float(np.sqrt(stiffness * first.row @ inverse @ first.row)), stiffness)
