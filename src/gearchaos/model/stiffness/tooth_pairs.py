"""Mesh stiffness of tooth pairs that share the load, each with its own gap."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gearchaos.errors import InputError
from gearchaos.model.contacts import OneSidedContacts
from gearchaos.model.stiffness.base import Stiffness
from gearchaos.model.stiffness.stepped import MAX_LEVELS
from gearchaos.model.stiffness.two_level import TwoLevelStiffness
from gearchaos.quantities import NOT_NEGATIVE, Quantity, Range, Rule
from gearchaos.validation import check_rule, to_float, to_floats

_POSITIVE = Rule(lambda v: v > 0, "must be greater than 0", "A level is the stiffness of one tooth pair over c0.")
SHARE = Rule(lambda v: (v > 0) & (v <= 1), "must lie in (0, 1]", "It is a share of the path of contact.")
ON_PATH = Rule(lambda v: (v >= 0) & (v < 1), "must lie in [0, 1)", "It is a share of the path of contact.")
PHASE = Rule(ON_PATH.holds, ON_PATH.text, "It is a share of the mesh period.")
CONTACT_RATIO = Rule(
    lambda v: (v >= 1) & (v <= 4), "must lie in [1, 4]",
    "Below 1 contact is lost between two tooth pairs; more than four pairs at a time are not followed. Change the "
    "addenda or the centre distance.")
_EXPONENT = Rule(lambda v: (v == 1) | (v == 2), "must be 1 or 2", "1 is a linear relief, 2 a parabolic one.")
_TABLE = "[model.stiffness]"
_CORNER_TOLERANCE = 2e-4  # by how much the gap of corner contact may differ from its polynomial, half backlashes
_LOOKS = 64  # positions beyond the path at which its gap is looked at
_SHORT = 1e-14  # length of a piece in mesh periods that is a rounding error
SHAPES = {"linear": 1.0, "parabolic": 2.0}
"""Exponents of the shapes of a relief."""
_RELIEF = Quantity("relief", "C_a", r"C_a", title="tip relief", unit="delta", range=Range(0.0, 1.0, 0.0, 10.0),
                   members=("relief1", "relief2"), toml_table=_TABLE)
_LENGTH = Quantity("relief_length", "l_a", r"l_a", title="length of the relief", range=Range(0.05, 0.5, 0.01, 0.5),
                   members=("relief_length1", "relief_length2"), toml_table=_TABLE)


@dataclass(frozen=True)
class ToothPairStiffness(Stiffness):
    """Tooth pairs that share the load: each is a spring that pushes where its flanks touch.

    Pair j = 0, 1, ... is at x = (τ/T + j)/α on its path of contact, from 0, where it enters, to 1. It pushes with its
    stiffness over c0 at x times z − 1 − gap(x) where that is positive. Lengths are in half backlashes Δ. Back flanks
    touch later by the tooth thickness of wheel 1, and run from the tip of wheel 1, which drives, to its root.

    Beyond both ends of the path the tip corner of one wheel may touch the flank of the other: corner contact. There the
    pair has the stiffness of the end, and its gap is that of the end and a polynomial in the distance x beyond the end.

    Attributes
    ----------
    levels : tuple of float
        Stiffness of one pair over c0 on the parts of its path, each greater than 0.
    starts : tuple of float
        Where each part begins, as a share of the path; the first is 0.
    contact_ratio : float
        α, from 1 to 4: the length of the path in mesh periods, and so the tooth pairs on it on the average.
    relief1, relief2 : float
        Tip relief of the wheels: the gap at the end of the path, and at its beginning.
    relief_length1, relief_length2 : float
        Shares of the path over which they go to 0.
    relief_exponent : float
        1 for a linear, 2 for a parabolic relief.
    crowning : float
        Profile crowning: the gap at both ends of a parabola about the middle of the path.
    back_phase : float
        Tooth thickness of wheel 1 over the pitch, plus α (2 x − 1) of the pitch point, less whole numbers.
    corner1, corner2 : tuple of float
        Coefficients of x², x³, ... of the gap beyond the end of the path, by the tip corner of wheel 1, and before its
        beginning, by that of wheel 2.
    corner_length1, corner_length2 : float
        How far it goes on, as shares of the path; 0 without corner contact.

    Raises
    ------
    InputError
        If a value breaks its rule.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(kind="single", stiffness=gc.ToothPairStiffness(contact_ratio=1.6, relief1=0.3))
    >>> model.stiffness.relief1
    0.3
    """

    levels: tuple[float, ...] = (0.75,)
    starts: tuple[float, ...] = (0.0,)
    contact_ratio: float = 1.5
    relief1: float = 0.0
    relief2: float = 0.0
    relief_length1: float = 0.2
    relief_length2: float = 0.2
    relief_exponent: float = 1.0
    crowning: float = 0.0
    back_phase: float = 0.5
    corner1: tuple[float, ...] = ()
    corner2: tuple[float, ...] = ()
    corner_length1: float = 0.0
    corner_length2: float = 0.0

    kind, form = "tooth pairs", "tooth-pairs"
    noun, predicate = "a stiffness of tooth pairs", "has tooth pairs"
    keys = "levels and starts of one pair, contact_ratio, relief, relief_length, crowning"
    rows = (
        _RELIEF,
        replace(_RELIEF, name="relief1", symbol="C_a1", tex=r"C_{a1}", members=(), rule=NOT_NEGATIVE),
        replace(_RELIEF, name="relief2", symbol="C_a2", tex=r"C_{a2}", members=(), rule=NOT_NEGATIVE),
        _LENGTH,
        replace(_LENGTH, name="relief_length1", symbol="l_a1", tex=r"l_{a1}", members=(), rule=SHARE),
        replace(_LENGTH, name="relief_length2", symbol="l_a2", tex=r"l_{a2}", members=(), rule=SHARE),
        Quantity("crowning", "C_α", r"C_\alpha", title="profile crowning", unit="delta",
                 range=Range(0.0, 1.0, 0.0, 10.0), rule=NOT_NEGATIVE, toml_table=_TABLE),
        next(row for row in TwoLevelStiffness.rows if row.name == "contact_ratio"),
    )
    shared = True
    pair_fields = {"levels": "tooth_pairs"}  # noqa: RUF012 -- no field, and never changed

    def __post_init__(self) -> None:
        for name in self.lists():
            noun = "coefficients" if name.startswith("corner") else "levels"
            object.__setattr__(self, name, to_floats(f"stiffness.{name}", getattr(self, name), MAX_LEVELS, noun))
        for f in self.fields():
            if f.name not in self.lists():
                object.__setattr__(self, f.name, to_float(f.name, getattr(self, f.name)))
        if len(self.starts) != len(self.levels) or not self.starts or self.starts[0] != 0:
            rule = f"must have as many values as levels ({len(self.levels)}), the first 0"
            raise InputError("stiffness.starts", rule, self.starts,
                             "Stiffness of one tooth pair on parts of its path of contact, from entry on.")
        check_rule("stiffness.levels", np.array(self.levels), _POSITIVE)
        check_rule("stiffness.starts", np.array(self.starts), ON_PATH)
        if np.any(np.diff(self.starts) <= 0):
            raise InputError("stiffness.starts", "must increase strictly", self.starts)
        check_rule("relief_exponent", np.array(self.relief_exponent), _EXPONENT)
        check_rule("back_phase", np.array(self.back_phase), PHASE)
        for n in (1, 2):
            check_corner((f"corner_length{n}", self.corner_length1 if n == 1 else self.corner_length2),
                         (f"corner{n}", self.corner1 if n == 1 else self.corner2))
        self.check_together({f.name: getattr(self, f.name) for f in self.fields()}, np.zeros((0, 1)), np.zeros((0, 1)))

    @classmethod
    def check_together(cls, values: Mapping[str, Any], amplitudes: np.ndarray, phases: np.ndarray) -> None:
        check_rule("contact_ratio", values["contact_ratio"], CONTACT_RATIO)
        total = sum(np.where(np.asarray(values[f"relief{n}"]) > 0, values[f"relief_length{n}"], 0.0) for n in (1, 2))
        if np.any(total > 1 + 1e-12):
            raise InputError("relief_length", "must have a sum of both wheels of at most 1, the path of contact",
                             float(np.max(total)), "Shorten the relief of one wheel.")

    @classmethod
    def contacts(cls, values: Mapping[str, Any], size: int) -> OneSidedContacts:
        """The contacts of the pairs at ``size`` points; ``values`` are all fields, numbers or arrays (P,)."""
        v = {n: np.broadcast_to(np.asarray(values[n], float), size)[:, None, None]
             for n in ("contact_ratio", "relief1", "relief2", "relief_length1", "relief_length2", "crowning",
                       "corner_length1", "corner_length2")}
        ratio, back, after, before = (
            v["contact_ratio"], float(values["back_phase"]), v["corner_length1"], v["corner_length2"])
        front = _ages(ratio * before, ratio * (1 + after), 0.0)  # back flanks pass their path the other way
        rear = _ages(ratio * after, ratio * (1 + before), back)
        sides, age = np.repeat([1, -1], [len(front), len(rear)]), np.concatenate([front, rear])
        # the position of contact e on its path at the phase φ is first_e + φ slope_e, (P, M, 1)
        slope = sides[None, :, None] / ratio
        first = np.where(sides[None, :, None] > 0, age[None, :, None] / ratio, 1 + (back - age[None, :, None]) / ratio)
        # without a relief its mark is the end of the path, so that a point has the same pieces beside any others
        marks = [np.zeros_like(ratio), np.ones_like(ratio), np.where(v["relief2"] > 0, v["relief_length2"], 0.0),
                 np.where(v["relief1"] > 0, 1 - v["relief_length1"], 1.0),
                 *(np.full_like(ratio, start) for start in values["starts"][1:]),
                 *(1 + share * after for share in _corner_marks(values, 1)),
                 *(-share * before for share in _corner_marks(values, 2))]
        crossed = ((np.concatenate(marks, axis=2) - first) / slope).reshape(size, -1)
        inside = np.where((crossed > _SHORT) & (crossed < 1 - _SHORT), crossed, np.round(np.clip(crossed, 0.0, 1.0)))
        edges = np.sort(np.hstack([np.zeros((size, 1)), inside]), axis=1)
        for n in range(1, edges.shape[1]):  # marks as good as equal are one
            edges[:, n] = np.where(edges[:, n] - edges[:, n - 1] > _SHORT, edges[:, n], edges[:, n - 1])
        # pieces without length stay only beside a point that has one there
        edges = edges[:, np.any(np.diff(edges, axis=1, append=1.0) > 0, axis=0)]
        middle = first + slope * (edges + np.diff(edges, axis=1, append=1.0) / 2)[:, None, :]
        begin = first + slope * edges[:, None, :]
        level = np.searchsorted(values["starts"], middle, side="right") - 1
        stiffness = np.where((middle > -before) & (middle < 1 + after), np.array(values["levels"])[level.clip(0)], 0.0)
        gap = cls._gaps(values, v, begin, middle, slope, np.diff(edges, axis=1, append=1.0)[:, None, :])
        return OneSidedContacts(sides, age, edges, stiffness, np.where(stiffness[..., None] > 0, gap, 0.0))

    @staticmethod
    def _gaps(values: Mapping[str, Any], v: Mapping[str, np.ndarray], begin: np.ndarray, middle: np.ndarray,
              slope: np.ndarray, duration: np.ndarray) -> np.ndarray:
        """Coefficients (P, M, N, 3) in the time since each piece began of the gaps by relief, crowning and corners;
        ``begin`` and ``middle`` are the positions on the path, (P, M, N)."""
        gap = np.zeros((*middle.shape, 3))
        ends = ((v["relief2"], v["relief_length2"], v["relief_length2"] - begin, -slope),
                (v["relief1"], v["relief_length1"], begin - (1 - v["relief_length1"]), slope))
        for amount, over, distance, rate in ends:
            t, dt = distance / over, rate / over
            relieved = t + dt * (duration / 2) > 0
            linear = (t, dt + 0 * t, 0 * t)
            powers = linear if values["relief_exponent"] == 1 else (t * t, 2 * t * dt, dt * dt + 0 * t)
            gap += np.stack([np.where(relieved, amount * p, 0.0) for p in powers], axis=-1)
        t, dt = 2 * begin - 1, 2 * slope
        gap += np.stack([v["crowning"] * p for p in (t * t, 2 * t * dt, dt * dt + 0 * t)], axis=-1)
        for n, beyond, distance, rate in ((1, middle > 1, begin - 1, slope), (2, middle < 0, -begin, -slope)):
            if values[f"corner{n}"]:
                # the quadratic through the gap at the beginning, the middle and the end of each piece
                polynomial = np.polynomial.Polynomial([0.0, 0.0, *values[f"corner{n}"]])
                first, half, last = (polynomial(distance + rate * duration * share) for share in (0.0, 0.5, 1.0))
                length = np.where(duration > 0, duration, 1.0)
                corner = np.stack([first, (4 * half - 3 * first - last) / length,
                                   2 * (first - 2 * half + last) / length**2], axis=-1)
                corner[..., 0] += v[f"relief{n}"] + v["crowning"]
                gap = np.where(beyond[..., None], corner, gap)
        return gap

    @classmethod
    def parts(cls, values: Mapping[str, Any]) -> tuple[tuple[Any, Any], ...]:
        """Start and level of each part of the period of the sum of all pairs on their path on the front flank, without
        gaps."""
        size = max((np.size(values[f.name]) for f in cls.fields() if f.name not in cls.lists()), default=1)
        found = cls.contacts({**values, "corner_length1": 0.0, "corner_length2": 0.0}, size)
        total = found.stiffness[:, found.sides > 0].sum(axis=1)
        kept = [n for n in range(total.shape[1]) if n == 0 or np.any(total[:, n] != total[:, n - 1])]
        if size == 1:
            return tuple((float(found.edges[0, n]), float(total[0, n])) for n in kept)
        return tuple((found.edges[:, n], total[:, n]) for n in kept)

    @classmethod
    def from_pair(cls, pair: Any) -> ToothPairStiffness | None:
        given = pair.tooth_pairs
        if given is None:
            return None
        relief, half = given.relief, pair.half_backlash
        sides: dict[str, Any] = {} if relief is None else {
            f"{name}{n}": value for name, both in (
                ("relief", [amount / half for amount in relief.amount]), ("relief_length", relief.length))
            for n, value in enumerate(both, 1)} | {"relief_exponent": SHAPES[relief.shape]}
        corners: dict[str, Any] = {} if given.corner is None else {
            name: value for n, length, gap in zip((1, 2), given.corner.length, given.corner.gap, strict=True)
            for name, value in ((f"corner_length{n}", length), (f"corner{n}", tuple(a / half for a in gap)))}
        return cls(tuple(level / pair.c0 for level in given.stiffness), given.starts, given.contact_ratio,
                   crowning=given.crowning / half, back_phase=given.back_phase, **sides, **corners)

    def to_pair(self, c0: float, half_backlash: float) -> dict[str, Any]:
        shape = next(name for name, exponent in SHAPES.items() if exponent == self.relief_exponent)
        relief = {"amount": [self.relief1 * half_backlash, self.relief2 * half_backlash],
                  "length": [self.relief_length1, self.relief_length2], "shape": shape}
        corner = {"length": [self.corner_length1, self.corner_length2],
                  "gap": [[a * half_backlash for a in gap] for gap in (self.corner1, self.corner2)]}
        return {"tooth_pairs": {
            "stiffness": [level * c0 for level in self.levels], "starts": self.starts, "relief": relief,
            "contact_ratio": self.contact_ratio, "crowning": self.crowning * half_backlash,
            "back_phase": self.back_phase, **({"corner": corner} if self.corner1 or self.corner2 else {})}}

    @property
    def outline(self) -> str:
        return "tooth pairs"

    def describe(self) -> str:
        relief = f"relief {self.relief1:.4g} and {self.relief2:.4g}" if self.relief1 or self.relief2 else "no relief"
        return f"tooth pairs, contact ratio {self.contact_ratio:.4g}, {relief}"


def check_corner(length: tuple[str, float], gap: tuple[str, Sequence[float]]) -> None:
    """Raise `InputError` for a gap of corner contact that is none; both are a field and its value."""
    check_rule(length[0], np.array(length[1]), ON_PATH)
    if (length[1] > 0) != bool(gap[1]):
        raise InputError(gap[0], f"must have coefficients where {length[0]} is greater than 0, and none elsewhere",
                         list(gap[1]), "The gap beyond the path is their polynomial.")
    if np.any(np.polynomial.Polynomial([0.0, 0.0, *gap[1]])(np.linspace(0.0, length[1], _LOOKS)) < 0):
        raise InputError(gap[0], f"must make a gap that is nowhere negative up to {length[0]}", list(gap[1]),
                         "Teeth open beyond their path.")


def _ages(before: np.ndarray, until: np.ndarray, late: float) -> np.ndarray:
    """Of the pairs that may touch in a mesh period: from ``before`` their path begins until some periods after, (P,);
    all ``late`` by a share of a period."""
    return np.arange(-math.ceil(before.max() - late - 1e-12), math.ceil(until.max() + late - 1e-12))


def _corner_marks(values: Mapping[str, Any], wheel: int) -> np.ndarray:
    """Ends of the pieces on which a quadratic is as good as the gap of corner contact, as shares of how far it goes on.

    A quadratic through the ends and the middle of a piece of the length h differs by at most h³/(72 √3) times the
    greatest third derivative.
    """
    coefficients, length = values[f"corner{wheel}"], values[f"corner_length{wheel}"]
    if not coefficients or not length:
        return np.zeros(0)
    third = np.polynomial.Polynomial([0.0, 0.0, *coefficients]).deriv(3)
    steepest = np.abs(third(np.linspace(0.0, length, _LOOKS))).max()
    count = max(math.ceil(length * (steepest / (72 * math.sqrt(3) * _CORNER_TOLERANCE)) ** (1 / 3)), 1)
    return np.arange(1, count + 1) / count
