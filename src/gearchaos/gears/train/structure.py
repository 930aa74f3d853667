"""The elements of a train, and its smallest coordinates.

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

from gearchaos.gears.train.mesh import Mesh
from gearchaos.gears.train.parts import GROUND, Body, Shaft, Support, Units
from gearchaos.quantities import parameter_owner

Train = Any
"""A `Train`, whose module checks its trains by this one."""

RANK = 1e-9  # relative size of what is left of a row that depends on others
_SMALLEST_LENGTH = 1e-6  # unit of length where no mesh has backlash, m, or where the stops of a shaft touch, rad

Value = Callable[[str, str, float], np.ndarray]
"""A parameter of a part, by the name of that, its field, and the value of the train: (P,)."""


@dataclass(frozen=True, eq=False)
class Element:
    """A spring, a mesh or the stops of a shaft: its deflection is row·q + Σ prescribed[body] φ_body(t) + ahead
    − error."""

    name: str
    row: np.ndarray  # (n,)
    prescribed: dict[str, float]  # factors of the angles of bodies whose motion is prescribed
    owner: str = ""  # the part whose parameters are its stiffness and damping
    stiffness: float = 0.0
    damping: float = 0.0
    backlash: float = 0.0
    ahead: float = 0.0  # where pins of planets do not stand where they should
    mesh: Mesh | None = None
    stops: Shaft | None = None

    @property
    def contact(self) -> bool:
        """Whether it pushes in contact alone."""
        return self.mesh is not None or self.stops is not None


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
                                             shaft.stop_damping, stops=shaft))
        for body in train.bodies:
            held: Support | None = body.support or body.pin
            if held is not None:
                moved = self.centre(body) - (self._on_carrier(body) if body.pin else 0.0)
                rows = moved if held.direction is None else np.array(
                    [[np.cos(held.direction), np.sin(held.direction)]]) @ moved
                self.springs += [Element(body.name, row, {}, "", held.stiffness, held.damping) for row in rows]
        self._choose()

    @property
    def linear(self) -> list[Element]:
        """The elements while all meshes are in contact; stops act where a shaft has no spring beside them."""
        return [each for each in self.contacts if self.spring_beside(each) is None] + self.springs

    def spring_beside(self, element: Element) -> Element | None:
        """The spring of the shaft of which an element is a stop; None of all others."""
        return next((each for each in self.springs if element.stops and each.name == element.name), None)

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
        normal, ahead = np.zeros(2), 0.0
        moves = any(self.centre(body).any() for body in (a, b))
        if moves or held:
            direction = mesh.line_of_action or 0.0
            if held and mesh.line_of_action is None and mesh.pressure_angle is not None:
                planet = a if a.carrier else b
                # seen from the carrier, the front flanks of the first wheel push towards where its teeth move, those
                # of a planet at its sun against its own sense; they push wheels apart, and planet and ring together
                along = -sense if planet is a and not mesh.internal else sense
                outwards = 1.0 if (planet is a) == mesh.internal else -1.0
                direction = planet.position + along * (np.pi / 2 - outwards * mesh.pressure_angle)
            normal = np.array([np.cos(direction), np.sin(direction)])
            for body, sign in ((a, 1.0), (b, -1.0)):
                tangent = np.array([-np.sin(body.position), np.cos(body.position)])
                ahead += sign * body.position_error * float(normal @ tangent)
        if held and not moves:  # the carrier is prescribed or held
            factors[held] = factors.get(held, 0.0) - sense * (ra + other)
        row, prescribed = self._angles(factors)
        row = row + normal @ (self.centre(a) - self.centre(b))
        return Element(mesh.name, row, prescribed, mesh.name, damping=mesh.damping, backlash=mesh.backlash, ahead=ahead,
                       mesh=mesh)

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
            if np.linalg.norm(left) > RANK * np.linalg.norm(row):
                basis = np.vstack([basis, left / np.linalg.norm(left)])
                self.chosen.append(element)
        self.S = np.array([element.row for element in self.chosen])
        _, _, v = np.linalg.svd(self.S)
        free = v[len(self.S):].T
        radius = self.train.first_radii[0]
        forward = np.where(free[:1] < 0, -1.0, 1.0)  # the first body in its own sense
        self.rigid = forward * free / np.abs(free).max(axis=0, initial=0.0) / radius  # (n, n - r)
        damped = any(body.damping for body in self.free)
        self.turning = self.rigid if damped else self.rigid[:, :0]
        self.names = tuple(name for element in self.chosen for name in self.coordinate(element)) + tuple(
            f"rotation{i or ''}_dot" for i in range(self.turning.shape[1]))

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
        inertia = self._at_angles({body.name: value(body.name, "inertia", body.inertia) for body in self.free})
        out = np.zeros((*inertia.shape, inertia.shape[1]))
        for body in self.train.bodies:
            if not body.prescribed:
                i = self.index[body.name, "angle"]
                out[:, i, i] += inertia[:, i]
            if body.mass is not None:
                moved = self.centre(body)
                out += body.mass * moved.T @ moved
        return out

    def torques(self, value: Value) -> np.ndarray:
        """Mean generalised forces (P, n)."""
        return self._at_angles({
            body.name: value(body.name, "torque", self.train.torque_of(body)) * self.sense(body.name)
            for body in self.free})

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
        return self._at_angles({body.name: value(body.name, "damping", body.damping) for body in self.free})

    def _at_angles(self, values: dict[str, np.ndarray]) -> np.ndarray:
        """Values (P,) of bodies by name at the places of their angles, (P, n), others 0."""
        out = np.zeros((max((len(v) for v in values.values()), default=1), len(self.index)))
        for name, value in values.items():
            out[:, self.index[name, "angle"]] = value
        return out

    @cached_property
    def orders(self) -> np.ndarray:
        """Orders of all excitations of the forcing as multiples of the common one, ascending, (H,) int."""
        train, base = self.train, self.train.base_order
        found = {train.followed_order(each.ratio)
                 for body in train.bodies for each in (*(body.motion or ()), *body.torque_orders)}
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
                out[self._at(self.train.followed_order(each.ratio)), self.index[body.name, "angle"]] += (
                    self.sense(body.name) * each.amplitude * np.exp(1j * each.phase))
        return out

    def deflection_harmonics(self, element: Element, speed: np.ndarray) -> np.ndarray:
        """Complex amplitudes (P, H) of h(t), the prescribed part of a deflection; ``speed`` (P,) of body 1, rad/s."""
        out = np.zeros((len(speed), len(self.orders)), complex)
        for name, factor in element.prescribed.items():
            for each in self.train.body(name).motion:
                order = self.train.followed_order(each.ratio)
                size = each.angle if each.angle is not None else (
                    -each.acceleration / (float(order) * speed) ** 2)
                out[:, self._at(order)] += factor * self.sense(name) * size * np.exp(1j * each.phase)
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


@lru_cache(maxsize=256)
def _mean_of(mesh: Mesh) -> float:
    found = mesh.contacts(on_path=True)
    length = np.diff(found.edges[0], append=1.0)
    return float(found.stiffness[0][found.sides > 0].sum(axis=0) @ length)


def mean_stiffness(element: Element) -> float:
    """The stiffness of an element, the mean of a mesh over its cycle on its path without gaps."""
    return element.stiffness if element.mesh is None else _mean_of(element.mesh)


def units_of(train: Train) -> Units:
    """The units of a train."""
    found = structure(train)
    first = found.contacts[0]
    lengths = [mesh.backlash / 2 for mesh in train.meshes] or [shaft.stop for shaft in train.shafts]
    length = next(filter(None, lengths), _SMALLEST_LENGTH)
    stiffness = mean_stiffness(first)
    inverse = np.linalg.inv(found.mass(as_given)[0])
    return Units(length, float(np.sqrt(stiffness * first.row @ inverse @ first.row)), stiffness)
