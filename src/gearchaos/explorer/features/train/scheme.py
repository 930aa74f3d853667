"""The scheme of a train as a picture whose parts can be chosen, the list of its parts, and its natural modes."""

from __future__ import annotations

import json
import math
import string
from collections.abc import Callable, Iterable
from fractions import Fraction
from functools import lru_cache
from itertools import count
from typing import NamedTuple

import numpy as np

from gearchaos.cards.card import card
from gearchaos.gears.io.units import measured
from gearchaos.gears.train.mesh import Mesh
from gearchaos.gears.train.modes import modes
from gearchaos.gears.train.parts import GROUND, Body
from gearchaos.gears.train.train import Train
from gearchaos.plot._train import RIM
from gearchaos.plot._train import Scheme as Layout

_WIDTH, _FLAT = 100.0, 1.5  # of the picture, in its units, and over its height, or less
_MARGIN, APART = 4.0, 5.0  # beyond all circles; least distance of the middles of two labels
_DIRECTIONS = 16  # in which a place for a label is looked for
_TURN = 20.0  # largest angle of a body in a mode that is shown, degrees
_STEEL, _SHADE = "#e8ecf4", "#cfd7e6"

_LETTERS = [*string.ascii_uppercase, *(f"{first}{second}" for first in string.ascii_uppercase
                                      for second in string.ascii_uppercase)]
"""Names of meshes in the picture; bodies have numbers."""

Point = tuple[float, float]
Place = Callable[[Iterable[float]], Point]
"""A function that gives the place of a point of the layout in the picture."""


class BodyMark(NamedTuple):
    """A body in the picture: circles by radius with their colour, or a ring; where its label is; the centres of its
    planets if it is a carrier."""

    name: str
    centre: Point
    circles: list[tuple[float, str]]
    width: float  # of a ring; 0 for wheels
    label: Point
    planets: list[Point]
    words: str


class MeshMark(NamedTuple):
    """A mesh in the picture: where its letter is, and the ends of the line to its wheels, which may not touch."""

    name: str
    letter: str
    label: Point
    ends: list[Point]
    words: str


class Scheme(NamedTuple):
    """A train as a picture of this height, its parts, other facts, and its modes: words, and where bodies go, as JSON.
    """

    height: float
    bodies: list[BodyMark]
    meshes: list[MeshMark]
    shafts: list[tuple[list[Point], str]]
    rest: list[tuple[str, str]]
    modes: list[str]
    shapes: str


@lru_cache(maxsize=16)
def scheme(train: Train) -> Scheme:
    """The picture of a train, as `gearchaos.plot.train` lays it out, and the rows of its card."""
    layout = Layout(train)
    low, high = layout.limits()
    size = (_WIDTH - 2 * _MARGIN) / max(high[0] - low[0], (high[1] - low[1]) * _FLAT)
    left = _MARGIN + (_WIDTH - 2 * _MARGIN - size * (high[0] - low[0])) / 2

    def place(point: Iterable[float]) -> Point:
        x, y = point
        return round(left + size * (x - low[0]), 3), round(_MARGIN + size * (high[1] - y), 3)

    words: dict[str, list[str]] = {}
    for kind, text in card(train).rows:
        words.setdefault(kind, []).append(text)
    taken: list[Point] = []
    meshes = [_mesh(layout, mesh, place, taken, letter, text) for mesh, text, letter in zip(
        train.meshes, words["mesh"], _LETTERS, strict=False)]
    of = dict(zip((body.name for body in train.bodies), words["body"], strict=True))
    marks = {body.name: _body(layout, body, place, size, taken, of[body.name]) for body in sorted(
        train.bodies, key=lambda body: len(layout.on_axis(body.name)))}  # planets before what is around one axis
    bodies = [marks[name] for name in of]
    shafts = [(_ends(layout, shaft.between, place), text) for shaft, text in zip(
        train.shafts, words.get("shaft", []), strict=True)]
    rest = [(kind, text) for kind, texts in words.items() if kind not in ("mesh", "body") for text in texts]
    return Scheme(size * float(high[1] - low[1]) + 2 * _MARGIN, bodies, meshes, shafts, rest,
                  *_modes(train, layout, size))


def _body(layout: Layout, body: Body, place: Place, size: float, taken: list[Point], words: str) -> BodyMark:
    name = body.name
    centre, ring = place(layout.centres[name]), layout.ring(name)
    planets = [place(layout.centres[each.name]) for each in layout.train.bodies if each.carrier == name]
    radii = sorted((size * radius for radius in layout.radii[name] or [layout.radius(name)]), reverse=True)
    if planets:
        radii = [math.dist(centre, planets[0])]
    circles = [(round(radius, 3), "none" if ring or planets else _SHADE if n else _STEEL)
               for n, radius in enumerate(radii)]
    near = [radii[0] * (1 + RIM / 2)] if ring else [radii[0]] if planets else [0.0, 0.6 * radii[0], radii[0]]
    return BodyMark(name, centre, circles, round(radii[0] * RIM, 3) if ring else 0.0, _free(centre, near, taken),
                    planets, words)


def _mesh(layout: Layout, mesh: Mesh, place: Place, taken: list[Point], letter: str, words: str) -> MeshMark:
    one, other = (np.array(layout.centres[name]) for name in mesh.between)
    (a, b), apart = layout.of_mesh(mesh), float(np.linalg.norm(other - one))
    along = (other - one) / apart if apart else np.array([0.0, 1.0])
    start, end = one + along * a, other - along * b
    if mesh.internal:  # both touch on the same side
        start = end = one + along * a if a > b else one - along * a
    return MeshMark(mesh.name, letter, _free(place((start + end) / 2), [0.0, APART, 2 * APART], taken),
                    [place(start), place(end)], words)


def _ends(layout: Layout, between: tuple[str, str], place: Place) -> list[Point]:
    """The centres that a shaft connects; none for one to the ground."""
    return [] if GROUND in between else [place(layout.centres[name]) for name in between]


def _free(centre: Point, radii: Iterable[float], taken: list[Point]) -> Point:
    """A place for a label at one of some distances from a centre, or beyond, where no other is near; it is then taken.
    """
    radii = list(radii)
    further = (radii[-1] + APART * n for n in count(1))
    for radius in (*radii, *(next(further) for _ in range(_DIRECTIONS))):
        for angle in np.radians(75 + np.arange(_DIRECTIONS) * 360 / _DIRECTIONS):
            found = (round(centre[0] + radius * math.cos(angle), 3), round(centre[1] - radius * math.sin(angle), 3))
            if all(math.dist(found, other) >= APART for other in taken):
                taken.append(found)
                return found
    taken.append(centre)
    return centre


def _modes(train: Train, layout: Layout, size: float) -> tuple[list[str], str]:
    """The modes that deflect something in words, with the speeds at which mesh frequencies meet them, and by mode and
    body how it turns, degrees, and moves."""
    found, words, shapes = modes(train), [], list[dict[str, list[float]]]()
    names = [body.name for body in train.bodies]
    orders: dict[Fraction, str] = {}  # the first mesh of each mesh frequency
    for letter, mesh in zip(_LETTERS, train.meshes, strict=False):
        orders.setdefault(train.mesh_order(mesh), letter)
    sense = np.array([math.copysign(1.0, train.speeds[name]) for name in names])
    radii = np.array([layout.radius(name) for name in names])
    for n in np.flatnonzero(found.frequency).tolist():
        angle, moved = sense * found.angle[n], found.displacement[n].copy()
        for body, at in zip(train.bodies, moved, strict=True):
            if body.carrier:  # it is taken along
                at += angle[names.index(body.carrier)] * layout.orbit(body) * np.array(
                    [-math.sin(body.position), math.cos(body.position)])
        scale = math.radians(_TURN) / max(np.abs(angle).max(), (np.linalg.norm(moved, axis=1) / radii).max())
        drawn = scale * np.column_stack([-np.degrees(angle), size * moved[:, 0], -size * moved[:, 1]])
        shapes.append(dict(zip(names, np.round(drawn, 3).tolist(), strict=True)))
        most = [f"{of[int(share.argmax())]} {100 * share.max():.0f} %" for of, share in (
            (names, found.kinetic_energy[n]), (found.elements, found.strain_energy[n]))]
        frequency = found.frequency[n] / (2 * math.pi)
        met = [f"{60 * frequency / float(order):.0f}{f' ({letters})' if len(orders) > 1 else ''}"
               for order, letters in orders.items()]
        words.append(f"{measured(frequency, 3)} Hz, ζ {measured(found.damping_ratio[n], 2)}, energy most in {most[0]} "
                     f"and {most[1]}, met at {', '.join(met)} rpm of {names[0]}")
    return words, json.dumps(shapes)


def mesh_verdicts(rows: Iterable[tuple[str, ...]], unit: str = "N") -> dict[str, dict[str, str]]:
    """The contact of each mesh, and its row in the table of a verdict in words, forces in a ``unit``, by its name."""
    return {name: {"contact": contact, "words": f"{contact}, front flanks {front}, back flanks {back} of the time, "
                   f"peak {peak} {unit}, {impacts} impacts/s, dynamic factor {factor}"}
            for name, contact, front, back, peak, impacts, factor in rows}
