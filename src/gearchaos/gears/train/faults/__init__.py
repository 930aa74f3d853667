"""Faults of single teeth, a file for each kind; `FaultKind` says how to add one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, make_dataclass, replace
from typing import Any

from gearchaos.errors import InputError
from gearchaos.gears.io import units
from gearchaos.gears.io.fields import Record, read_by
from gearchaos.gears.train.faults.base import FaultKind
from gearchaos.plugins import Register, declared, value_of

__all__ = ["Fault", "FaultKind", "check_faults"]


def _whole(field: str, value: Any) -> int:
    if isinstance(value, bool) or not hasattr(value, "__index__") or value.__index__() < 1:
        raise InputError(field, "must be a whole number from 1 on", value,
                         "Wheels are 1 and 2; teeth are counted from 1 in the order in which they mesh.")
    return int(value.__index__())


FAULTS: Register[FaultKind] = Register("gearchaos.faults", declared(__name__, "FAULT"), value_of(FaultKind, ""))
"""The kinds of faults by name; those of gearchaos are fields of `Fault`, those of other packages are in ``others``."""


def _others(field: str, value: Any) -> tuple[tuple[str, float], ...]:
    """Faults of other packages, from a table of their values by kind, or from the pairs that this returns."""
    try:
        given = dict(value)
    except (TypeError, ValueError):
        raise InputError(field, "must be a table", value, "E.g. others = { pitting = 0.2 }.") from None
    for name in given:
        FAULTS.check(f"{field}.{name}", name)
        if name in FAULTS.own:
            raise InputError(f"{field}.{name}", "must stand beside others, not in it", given[name])
    return tuple((name, FAULTS[name].read(f"{field}.{name}", each)) for name, each in given.items())


_Values: Any = make_dataclass("_Values", [
    ("wheel", int, field(metadata=read_by(_whole))), ("tooth", int, field(metadata=read_by(_whole))),
    *((name, float, field(default=0.0, metadata={**read_by(kind.read), "kind": kind}))
      for name, kind in FAULTS.own.items())], bases=(Record,), frozen=True, kw_only=True)


@dataclass(frozen=True, kw_only=True)
class Fault(_Values):
    """A tooth that differs: its ``wheel`` and ``tooth``, by name the value of each kind of fault that has a file here,
    and in ``others`` the values of kinds that other packages offer."""

    others: Any = field(default=(), metadata=read_by(_others))

    @property
    def found(self) -> dict[str, tuple[FaultKind, float]]:
        """The kinds of fault that the tooth has, with their values, by field."""
        own = {f.name: (f.metadata["kind"], value) for f in fields(self)
               if "kind" in f.metadata and (value := getattr(self, f.name))}
        return own | {name: (FAULTS[name], value) for name, value in self.others if value}

    @property
    def stiffness_share(self) -> float:
        """The share of the stiffness that is left of the pairs in which the tooth meshes."""
        return math.prod(kind.stiffness_share(value) for kind, value in self.found.values())

    @property
    def back(self) -> float:
        """How far the driving flank stands back along the line of action, m."""
        return sum(kind.back(value) for kind, value in self.found.values())

    @property
    def drawn(self) -> dict[str, tuple[FaultKind, float]]:
        """Those of `found` whose effect follows from the drawing of the gears."""
        return {name: each for name, each in self.found.items() if each[0].gives}

    def as_drawn(self, pairs: Any) -> Fault:
        """The fault with what follows from the tooth pairs of a drawing; raises `InputError`."""
        known: dict[str, Any] = dict.fromkeys(self.drawn, 0.0)
        for kind, value in self.drawn.values():
            known[kind.gives] = kind.given(pairs, self.wheel - 1, value)
        others = tuple((name, value) for name, value in self.others if name not in known)
        return replace(self, **{name: value for name, value in known.items() if name not in dict(self.others)},
                       others=others)


def check_faults(faults: Sequence[Fault], teeth: Sequence[int], drawn: bool) -> None:
    """Raise `InputError` for a fault of a wheel or a tooth that there is not, a tooth that is named twice, or what
    follows from a drawing where the gears are not ``drawn``."""
    for i, fault in enumerate(faults):
        if fault.wheel not in (1, 2):
            raise InputError(f"faults[{i}].wheel", "must be 1 or 2", fault.wheel)
        if fault.tooth > teeth[fault.wheel - 1]:
            raise InputError(f"faults[{i}].tooth", f"must be at most {teeth[fault.wheel - 1]}, the number of teeth",
                             fault.tooth)
        if (fault.wheel, fault.tooth) in {(other.wheel, other.tooth) for other in faults[:i]}:
            raise InputError(f"faults[{i}].tooth", "must be that of no other fault of the wheel", fault.tooth,
                             "Write one fault with both values.")
        for name, (kind, value) in fault.drawn.items():
            if kind.gives in fault.found:
                raise InputError(f"faults[{i}].{name}", f"must be left out beside {kind.gives}",
                                 units.Shown(value, value))
            if not drawn:
                raise InputError(f"faults[{i}].{name}", "must stand in the table [design] of the gears",
                                 units.Shown(value, value), kind.advice)
