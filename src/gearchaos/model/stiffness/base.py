"""What all kinds of mesh stiffness have in common, and how to add one."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, Field, fields, replace
from typing import Any, ClassVar, Self

import numpy as np

from gearchaos.errors import InputError
from gearchaos.quantities import Quantity, parse_harmonic


class Stiffness(ABC):
    """A mesh stiffness over the reference stiffness c0, periodic in the mesh period T = 2π/ω.

        χ(τ) = level of the part of the period in which τ lies + Σ_j c_j cos(jωτ − α_j)

    Without parts the level is 1. Whatever deals with a stiffness takes it from its class: the flow, names and sliders
    of its parameters, study files, stored results, cards, pictures, scripts, SymPy, and proofs. Only the program that
    checks proofs reads certificates in its own way.

    **To add a kind,** write a frozen dataclass that derives from this class in a file of its own in this folder.
    Its fields are numbers or tuples of numbers; they are also the keys of
    ``[model.stiffness]``. It checks them when it is created, and has `parts`, `describe` and the attributes below.
    A rule between fields of which some have a name is also checked by `check_together`, for values that vary.
    The rest of this class follows from these, and is there to be overridden where it does not fit.
    """

    kind: ClassVar[str]  # name in study files and on pages
    form: ClassVar[str]  # name in certificates
    noun: ClassVar[str]  # how messages call it: "a Fourier stiffness, (2.7)"
    predicate: ClassVar[str]  # what a model with it does: "is a Fourier series"
    keys: ClassVar[str]  # of ``[model.stiffness]``, in words
    equation: ClassVar[str] = ""  # its number; empty if the paper has none
    rows: ClassVar[tuple[Quantity, ...]] = ()  # fields set by name, and pairs: for axes, ``--set`` and the explorer
    families: ClassVar[tuple[Quantity, ...]] = ()  # amplitude and phase of its Fourier series, c and alpha, if any
    letters: ClassVar[Mapping[str, str]] = {}  # other names of fields, in equations, scripts and certificates
    level_names: ClassVar[tuple[str, ...]] = ()  # what is in levels and in no start: a proof over a box can vary it
    part_marks: ClassVar[tuple[tuple[str, str], ...]] = ()  # for a picture, duration and level of each part in mathtext
    pair_fields: ClassVar[Mapping[str, str]] = {}  # `GearPair`'s field for each field; empty if pairs lack this kind
    shared: ClassVar[bool] = False  # whether tooth pairs share the load, as `contacts` of a class of its own says
    stiffness_fields: ClassVar[tuple[str, ...]] = ()  # those whose values in a `GearPair` are c0 times as large

    @classmethod
    @abstractmethod
    def parts(cls, values: Mapping[str, Any]) -> Sequence[tuple[Any, Any]]:
        """Start and level of each part of the period in which the level is constant; none for a level of 1.

        ``values`` are the numbers of a stiffness, as `numbers` gives them. They may be floats, arrays of many points,
        fractions, balls, symbols or names in a script, so only + − × ÷ apply to them. Starts are in ascending order,
        fractions of the mesh period from 0 to 1. The last level lasts until the first start of the next period.
        """

    @abstractmethod
    def describe(self) -> str:
        """The stiffness in a few words with its main values, for a card."""

    @property
    def outline(self) -> str:
        """How it is made, for a legend, e.g. "two levels"."""
        return self.describe()

    @classmethod
    def example(cls) -> Self:
        """What the explorer shows where this kind is chosen."""
        return cls()

    def check_one_spring(self, what: str) -> None:
        """Raise `InputError` if tooth pairs share the load, where ``what`` can only have one spring."""
        if self.shared:
            raise InputError("stiffness", f"must be one spring for {what}", self.describe(),
                             "Of a design: load_sharing = 'prescribed', or --set design.load_sharing=prescribed. Else "
                             "give the sum of the pairs as a SteppedStiffness. Relief then has no effect.")

    def check(self, varied: Mapping[str, Any], amplitudes: np.ndarray, phases: np.ndarray) -> None:
        """`check_together` for a batch of this stiffness with other values, arrays (P,), for some parameters."""
        self.check_together({f.name: varied.get(f.name, getattr(self, f.name)) for f in self.fields()},
                            amplitudes, phases)

    @classmethod
    def check_together(cls, values: Mapping[str, Any], amplitudes: np.ndarray, phases: np.ndarray) -> None:
        """Raise `InputError` for numbers that do not go together at a point of a batch.

        ``values`` are all fields, checked by their own rules already, those that vary as arrays (P,); ``amplitudes``
        and ``phases`` are c_j and α_j, each (H, P).
        """
        return

    @classmethod
    def fields(cls) -> tuple[Field[Any], ...]:
        """The fields of the dataclass."""
        return fields(cls)  # type: ignore[arg-type]

    @classmethod
    def lists(cls) -> tuple[str, ...]:
        """The fields that are tuples of numbers."""
        return tuple(f.name for f in cls.fields() if "tuple" in str(f.type))

    @classmethod
    def record_keys(cls) -> tuple[str, ...]:
        """The keys of ``[model.stiffness]``: pairs of parameters and fields."""
        return tuple(dict.fromkeys([*(q.name for q in cls.rows), *(f.name for f in cls.fields())]))

    def record(self) -> dict[str, Any]:
        """The fields as numbers and lists, for files."""
        values = {f.name: getattr(self, f.name) for f in self.fields()}
        return {n: list(v) if isinstance(v, tuple) else v for n, v in values.items()}

    @classmethod
    def from_record(cls, record: Mapping[str, Any]) -> Self:
        """The stiffness with these fields. A list left out that has no default is empty: its rule refuses it."""
        needed = {f.name: () for f in cls.fields() if f.default is MISSING}
        return cls(**needed | {n: tuple(v) if isinstance(v, (list, tuple)) else v for n, v in record.items()})

    def numbers(self) -> dict[str, Any]:
        """The fields by their names in equations."""
        return {self.letters.get(f.name, f.name): getattr(self, f.name) for f in self.fields()}

    def harmonics(self) -> tuple[Sequence[float], Sequence[float]]:
        """c_j and α_j of its Fourier series, from harmonic 1 on."""
        numbers = self.numbers()
        amplitudes, phases = (numbers[q.name] for q in self.families) if self.families else ((), ())
        return amplitudes, phases

    def at(self, tau: Any, omega: float) -> np.ndarray:
        """χ at times of any shape, for a mesh frequency ω."""
        tau = np.asarray(tau, dtype=float)
        chi = np.ones_like(tau)
        if parts := self.parts(self.numbers()):
            starts, levels = zip(*parts, strict=True)
            begun = np.searchsorted(starts, np.mod(tau / (2 * math.pi / omega), 1.0), side="right") - 1
            chi = np.array(levels)[begun]  # before the first start it is -1, the last level
        for j, (a, p) in enumerate(zip(*self.harmonics(), strict=True), start=1):
            chi = chi + a * np.cos(j * omega * tau - p)
        return np.asarray(chi)

    @property
    def jumps(self) -> tuple[float, ...]:
        """Where the level may jump, as fractions of the mesh period; the stiffness is smooth in between."""
        return tuple(start for start, _ in self.parts(self.numbers()))

    def extremes(self) -> tuple[float, float]:
        """Least and greatest χ; of a Fourier series, on a grid of 64 positions per harmonic."""
        count = 64 * len(self.harmonics()[0])
        chi = self.at(np.arange(count) / count if count else self.jumps or (0.0,), 2 * math.pi)
        return float(chi.min()), float(chi.max())

    @classmethod
    def accepts(cls, name: str) -> bool:
        """Whether this kind has a parameter, a pair or a harmonic of this name."""
        parts = parse_harmonic(name)
        return any(q.name == name for q in cls.rows) or (parts is not None and parts.family in {
            q.name for q in cls.families})

    @classmethod
    def parameter_names(cls) -> tuple[str, ...]:
        """The names by which its values are set; of the harmonics only the first of each family."""
        return (*(q.name for q in cls.rows), *(f"{q.name}1" for q in cls.families))

    @classmethod
    def advice(cls, name: str, present: Stiffness) -> str:
        """What to do to set a parameter of this kind where the stiffness is of another one."""
        names = f"{present.offered()}, or set " if present.offered() else ""
        return f"This model's {present.predicate}: set {names}stiffness={cls.__name__}()."

    @classmethod
    def offered(cls) -> str:
        """The names of its parameters in a message; of harmonics the first ones."""
        singles = [q.name for q in cls.rows if not q.members]
        return ", ".join([*singles, *(f"{q.name}1" for q in cls.families), *(["..."] if cls.families else [])])

    def parameters(self) -> dict[str, float]:
        """The values that have names of parameters, by name."""
        return {q.name: getattr(self, q.name) for q in self.rows if not q.members}

    def with_values(self, values: Mapping[str, Any]) -> Self:
        """The same kind with values replaced by name; other names are ignored."""
        return replace(self, **{n: v for n, v in values.items() if n in self.parameters()})  # type: ignore[type-var]

    def unnamed(self) -> dict[str, tuple[float, ...]]:
        """The fields that no name of a parameter sets, by name: lists of numbers that are not empty."""
        return {} if self.families else {n: v for n in self.lists() if (v := getattr(self, n))}

    @classmethod
    def from_pair(cls, pair: Any) -> Self | None:
        """The stiffness of a `GearPair` whose fields are given; None if it has none of this kind."""
        given = {n: v for n, of in cls.pair_fields.items() if (v := getattr(pair, of)) is not None}
        if not given or any(given.get(name) in (None, ()) for name in cls.stiffness_fields):
            return None
        return cls(**{n: _plain(np.divide(v, pair.c0)) if n in cls.stiffness_fields else v for n, v in given.items()})

    def to_pair(self, c0: float, half_backlash: float) -> dict[str, Any]:
        """The fields of a `GearPair` with this reference stiffness, N/m, and half its backlash, m."""
        values = {n: getattr(self, n) for n in self.pair_fields}
        return {self.pair_fields[n]: _plain(np.multiply(v, c0)) if n in self.stiffness_fields else v
                for n, v in values.items()}


def _plain(values: np.ndarray) -> float | tuple[float, ...]:
    """A field from an array: a number or a tuple of numbers."""
    found = values.tolist()
    return tuple(found) if isinstance(found, list) else found
