"""The equations of a train as a switched affine system in its smallest coordinates."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from gearchaos.errors import InputError
from gearchaos.gears.io.units import RPM
from gearchaos.gears.train.parts import Units
from gearchaos.gears.train.structure import RANK, Element, Structure, Value, mean_stiffness
from gearchaos.gears.train.teeth import uneven_contacts
from gearchaos.model.contacts import MeshContacts, OneSidedContacts
from gearchaos.model.damping import ALWAYS, CONTACT
from gearchaos.model.switched import SwitchedAffine

_SAME = 1e-9  # relative difference of instants and errors that coincide
_ITERATIONS = 20  # in which it is sought which stops act at rest
_ROUNDING = 1e-13  # of a deflection at rest, relative to the displacements of which it is the difference
_MOST_CONTACTS = 62  # a set of closed contacts is a whole number with a bit for each


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
        turn = np.einsum("nk,pnm->pkm", found.turning, self.mass)
        turned = found.turning.T[None] / np.einsum("pkm,mk->pk", turn, found.turning)[:, :, None]
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
        """row·q of the chosen elements midway between their flanks, with the sign reversed, (P, r)."""
        halves = [self.backlash(e) / 2 + e.ahead if e.mesh is not None else np.zeros(self.points)
                  for e in self.found.chosen]
        return np.stack(halves, axis=1)

    def coefficients(self, element: Element) -> np.ndarray:
        """The deflection of an element from the chosen ones, (r,), but for its prescribed part."""
        if element in self.found.chosen:
            return np.eye(len(self.found.S))[self.found.chosen.index(element)]
        c = np.linalg.lstsq(self.found.S.T, element.row, rcond=None)[0]
        return np.where(np.abs(c) < RANK * np.abs(c).max(), 0.0, c)

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
            return self.half_play(element, 1.0) + self.half_play(element, -1.0)
        return self._of(self.value(element.owner, "backlash", element.backlash))

    def half_play(self, element: Element, side: float | np.ndarray) -> np.ndarray:
        """How far the flank or stop of a side, 1 in front and −1 behind, stands from the middle, (P,)."""
        if not element.stops:
            return self.backlash(element) / 2
        front = self._of(self.value(element.owner, "stop", element.stops.stop))
        back = front if element.stops.stop_back is None else self._of(
            self.value(element.owner, "stop_back", element.stops.stop_back))
        return np.where(np.asarray(side) > 0, front, back)

    def system(self) -> SwitchedAffine:
        """The switched affine system, in the units of the train."""
        found, units, points, at, d = self.found, self.units, self.points, self.at, len(self.found.names)
        A, f0, harmonics = self._apart_from_contacts()
        rows, pushes, offsets = self._flanks()
        rates = np.roll(rows, 1, axis=1)  # the rate of a deflection follows it
        damping = np.stack([self.damping(element) for element in found.contacts], axis=1)
        laws = [found.train.law_of(element.mesh) for element in found.contacts]
        in_contact = np.array([law.in_contact for law in laws])
        A -= np.einsum("pki,pk,kj->pij", pushes, damping * ~in_contact, rates)
        size = np.full(d, units.length * units.rate)
        size[at] = units.length
        harmonics = harmonics / (size * units.rate)
        made = MeshContacts(
            names=tuple(element.name for element in found.contacts), front=offsets[0, :, 0] / units.length,
            rows=rows, rates=rates, pushes=pushes * units.force / (size * units.rate),
            damping=damping * units.rate / units.stiffness, in_contact=in_contact,
            releases=np.array([law.releases for law in laws]), orders=found.orders,
            f_cos=harmonics.real, f_sin=-harmonics.imag, **self._contacts(offsets))
        none, flat, over_time = np.zeros(points), np.zeros((points, 0)), np.zeros((points, len(found.orders)))
        return SwitchedAffine(
            names=found.names, omega=self.omega, A=A * size / size[:, None] / units.rate, b=made.pushes[:, 0],
            f0=f0 / (size * units.rate), f_cos=made.f_cos[:, :, 1], f_sin=made.f_sin[:, :, 1],
            levels=np.ones((points, 2)), starts=np.array([[0.0, 0.5]] * points), same_starts=True,
            chi_cos=flat, chi_sin=flat, velocity=np.tile(np.eye(d)[1], (points, 1)), velocity0=none,
            velocity_cos=over_time, velocity_sin=over_time, mean_velocity=none, rotation_decay=none,
            damping=made.damping[:, 0], law=CONTACT if in_contact.any() else ALWAYS,
            static_force=self.static[:, : len(rows)] / units.force, contacts=made)

    def _apart_from_contacts(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Linear part (P, d, d), constant forcing (P, d) and complex amplitudes of the harmonic forcing (P, H, d), SI.

        They are those of torques, prescribed motions, errors, the damping of bodies, and springs with their dampers.
        """
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
        for spring in found.springs:
            c, k, damping = self.coefficients(spring), self.stiffness(spring), self.damping(spring)
            pull = np.einsum("pvn,n->pv", self.to_speeds, spring.row)
            A[:, place[:, None], self.at] -= (k[:, None] * pull)[:, :, None] * c
            A[:, place[:, None], self.at + 1] -= (damping[:, None] * pull)[:, :, None] * c
            f0[:, place] += pull * (k * (self.middle @ c))[:, None]
            force = (k[:, None] + 1j * self.frequencies * damping[:, None]) * self._own_harmonics(spring)
            harmonics[:, :, place] -= np.einsum("ph,pv->phv", force, pull)
        return A, f0, harmonics

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
                                 "Where meshes form a loop, as in a planetary set without pins, an error of one must "
                                 "be that of the others. Give planets a pin, or errors to meshes outside of loops.")
            rows[m, self.at] = self.coefficients(element)
            pushes[:, m, self.place] = np.einsum("pvn,n->pv", self.to_speeds, element.row)
            front = self.middle @ rows[m, self.at] - element.ahead + (
                self.half_play(element, 1.0) if element.stops else 0.0)
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

        Where meshes close a loop, they share the load by their mean stiffnesses and what stands ahead. One that would
        have to pull carries nothing, and so does one whose deflection is a rounding error of its parts. A stop with a
        spring beside it acts where the twist exceeds its play.
        """
        elements = [*self.found.contacts, *self.found.springs]
        rows = np.array([element.row for element in elements])
        k = np.stack([self.stiffness(element) for element in elements], axis=1)
        torques, pushes = self._of(self.found.torques(self.value)), np.array([element.contact for element in elements])

        beside = np.array([self.found.spring_beside(element) is not None for element in elements])
        front, back = (np.stack([self.half_play(each, side) if stop else np.zeros(self.points) for each, stop in zip(
            elements, beside, strict=True)], axis=1) for side in (1.0, -1.0))
        side = np.zeros(k.shape)  # of the stops that act

        def forces(k: np.ndarray, ahead: np.ndarray) -> np.ndarray:
            nonlocal side
            for _ in range(_ITERATIONS):
                acts = np.where(beside & (side == 0), 0.0, k)
                gap = ahead - np.where(side > 0, front, -back * (side < 0))
                total = np.einsum("en,pe,em->pnm", rows, acts, rows)
                inverse = np.linalg.pinv(total, rcond=1e-12, hermitian=True)
                q = np.einsum("pnm,pm->pn", inverse, torques - (acts * gap) @ rows)
                twist = q @ rows.T
                rounding = _ROUNDING * (np.abs(q) @ np.abs(rows).T + np.abs(gap))
                found = acts * np.where(np.abs(twist + gap) <= rounding, 0.0, twist + gap)
                before, side = side, np.where(beside, 1.0 * (twist > front) - (twist < -back), 0.0)
                if np.array_equal(side, before):
                    break
            return found

        found = forces(k, np.zeros(len(elements)))
        if (ahead := np.array([element.ahead for element in elements])).any():
            flank = np.sign(found)
            while (pulls := pushes & ~beside & ((found := forces(k, ahead)) * flank < 0)).any():
                k = np.where(pulls, 0.0, k)
        return found

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
            spring = self.found.spring_beside(element)
            force = self.static[:, elements.index(spring or element)]
            if spring is not None:
                w[:, i] = force / self.stiffness(spring)
            elif element.contact:
                part, side, mean = self._over_period(element), np.where(force < 0, -1.0, 1.0), mean_stiffness(element)
                first = np.array([part.stiffness[0][part.sides == s, 0].sum() for s in (1, -1)])
                first = np.where(first > 0, first, mean)  # where the first teeth are missing
                w[:, i] = side * self.half_play(element, side) + force / (
                    np.where(side > 0, *first) * self.stiffness(element) / mean)
            else:
                w[:, i] = force / self.stiffness(element)
        return w / self.units.length

    def _contacts(self, offsets: np.ndarray) -> dict[str, Any]:
        """The contacts of all meshes on the pieces of the common period; ``offsets`` (P, K, 2) in m, of the flanks."""
        parts = [self._over_period(element) for element in self.found.contacts]
        releases = [self.found.train.law_of(element.mesh).releases for element in self.found.contacts]
        # whether a contact that releases pulls has a bit, too
        count = sum(len(part.sides) * (1 + twice) for part, twice in zip(parts, releases, strict=True))
        if count > _MOST_CONTACTS:
            most = max(zip(parts, self.found.contacts, strict=True), key=lambda each: len(each[0].sides))
            raise InputError(
                "meshes", f"must have at most {_MOST_CONTACTS} tooth pairs and stops that may touch, of both flanks",
                count, f"{most[1].name} alone has {len(most[0].sides)}. Without corner contact tooth pairs are fewer, "
                "and a mesh with the stiffness of all pairs together has two." + any(releases) * (
                    " Those with damping_law = 'unilateral' count twice."))
        every = np.unique(np.concatenate([part.edges[0] for part in parts]))
        edges = every[np.append(True, np.diff(every) > 1e-12)]
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
        mesh, train = element.mesh, self.found.train
        if mesh is None or mesh.constant:
            return _over_period(cycle(element), 1, 0.0)
        cycles = int(train.mesh_order(mesh) / train.base_order)
        part = _over_period(cycle(element), cycles, mesh.phase / (2 * np.pi) % 1.0)
        return uneven_contacts(mesh, part, cycles) if mesh.uneven else part


def cycle(element: Element) -> OneSidedContacts:
    """The contacts of one mesh cycle, in N/m and m; of stops in N m/rad and rad."""
    if element.mesh is not None:
        return element.mesh.contacts()
    return OneSidedContacts(np.array([1, -1]), np.zeros(2, int), np.zeros((1, 1)),
                            np.full((1, 2, 1), element.stiffness), np.zeros((1, 2, 1, 3)))


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
