"""A study in full: everything that decides its result, written beside it so that it can go on anywhere."""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from gearchaos.datasets import model_from_json, model_json
from gearchaos.dynamics import Classification
from gearchaos.dynamics.settings import FORMER_NAMES
from gearchaos.errors import InputError, unknown_name
from gearchaos.model import MeshModel
from gearchaos.studies.attractors import plan as _attractors
from gearchaos.studies.axis import Axis
from gearchaos.studies.basins import plan as _basins
from gearchaos.studies.bifurcation import plan as _bifurcation
from gearchaos.studies.defaults import settings_for_kind
from gearchaos.studies.plan import Plan
from gearchaos.studies.simulate import plan as _simulate
from gearchaos.studies.zones import plan as _zones

_PLANS: dict[str, Callable[..., Plan]] = {
    "simulate": _simulate, "attractors": _attractors, "bifurcation": _bifurcation, "zones": _zones, "basins": _basins,
}
_AXES = {"bifurcation": 1, "zones": 2, "basins": 2}


@dataclass(frozen=True)
class Resolved:
    """A study of any kind but ``regime``, which is one point.

    Attributes
    ----------
    kind : str
    model : MeshModel
    axes : tuple of Axis
        In the order in which the study's function takes them.
    options : mapping
        Other arguments of the function, by name.
    settings : Classification, optional
    """

    kind: str
    model: MeshModel
    axes: tuple[Axis, ...] = ()
    options: Mapping[str, Any] = field(default_factory=dict)
    settings: Classification | None = None

    def __post_init__(self) -> None:
        """Fill in what is not said, so that the record is whole whatever later versions have for defaults."""
        if self.kind not in _PLANS:
            raise unknown_name("study.kind", self.kind, _PLANS)
        arguments = inspect.signature(_PLANS[self.kind]).parameters
        defaults = {n: a.default for n, a in arguments.items() if a.default is not a.empty and n != "settings"}
        for name in self.options:
            if name not in arguments or name == "settings":
                raise unknown_name("study option", name, arguments.keys() - {"model", "x", "y", "axis", "settings"})
        object.__setattr__(self, "options", {**defaults, **self.options})
        if self.settings is None and "settings" in arguments:
            object.__setattr__(self, "settings", settings_for_kind(self.kind, {}))

    def plan(self) -> Plan:
        """The study's pieces, checked; raises `InputError` as its function would."""
        needed = _AXES.get(self.kind, 0)
        if len(self.axes) != needed:
            raise InputError("axes", f"must be {needed} for kind {self.kind!r}", [a.name for a in self.axes])
        if self.kind != "simulate":
            return _PLANS[self.kind](self.model, *self.axes, **self.options, settings=self.settings)
        if self.settings is not None:
            raise InputError("settings", "must be left out for kind 'simulate'", self.settings,
                             "A simulation classifies nothing.")
        if "periods" not in self.options:
            raise InputError("study.periods", "must be given", None, "E.g. periods = 100.")
        return _simulate(self.model, **self.options)

    def to_dict(self) -> dict[str, Any]:
        """All of it as JSON-ready values."""
        words = {
            "kind": self.kind, "model": json.loads(model_json(self.model)), "axes": [asdict(a) for a in self.axes],
            "options": {n: asdict(v) if isinstance(v, Axis) else v for n, v in self.options.items()},
            "budget": None if self.settings is None else _record(self.settings),
        }
        return json.loads(json.dumps(words, default=lambda value: value.item()))

    @classmethod
    def from_dict(cls, words: Mapping[str, Any]) -> Resolved:
        """The inverse of `to_dict`."""
        options = {n: Axis(**v) if n == "sweep" and v else v for n, v in words["options"].items()}
        settings = None if words["budget"] is None else _from_record(words["budget"])
        axes = tuple(Axis(**a) for a in words["axes"])
        return cls(words["kind"], model_from_json(json.dumps(words["model"])), axes, options, settings)


def _record(settings: Classification) -> dict[str, Any]:
    """Classification settings by the names that the store's format has for them."""
    return {former: getattr(settings, name) for former, name in FORMER_NAMES.items()}


def _from_record(record: Mapping[str, Any]) -> Classification:
    """The inverse of `_record`."""
    values: dict[str, Any] = {FORMER_NAMES[former]: value for former, value in record.items()}
    return Classification(**{**values, "transient_lengths": tuple(values["transient_lengths"])})


def differences(stored: Mapping[str, Any], asked: Mapping[str, Any], field: str = "") -> list[str]:
    """Where two studies in words differ: "field: stored value, not asked value"."""
    out = []
    for name in sorted(stored.keys() | asked.keys()):
        one, other, where = stored.get(name), asked.get(name), f"{field}{name}"
        if isinstance(one, Mapping) and isinstance(other, Mapping):
            out += differences(one, other, f"{where}.")
        elif one != other:
            out.append(f"{where}: {one!r} in the store, {other!r} asked for")
    return out
