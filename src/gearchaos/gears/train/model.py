"""`TrainModel`: what studies take a `Train` for, with the values that can be set and varied by name."""

from __future__ import annotations

import difflib
import itertools
import math
import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np

from gearchaos.errors import InputError, unknown_name
from gearchaos.gears.io.units import RPM, SPEED, TORQUE, to_si
from gearchaos.gears.train.assembly import Assembly
from gearchaos.gears.train.mesh import Mesh
from gearchaos.gears.train.modes import fastest_mode, modes
from gearchaos.gears.train.parts import Body, Shaft, Units, field_of
from gearchaos.gears.train.planets import PlanetarySet
from gearchaos.gears.train.structure import mean_stiffness, structure, units_of
from gearchaos.gears.train.train import BALANCE, Train
from gearchaos.model.base import GearModel
from gearchaos.model.coordinates import (
    initial_state,
    mesh_rotation,
    prescribed_rates_at_start,
    to_physical,
    transmission_error_at_start,
)
from gearchaos.model.damping import CONTACT, DampingLaw
from gearchaos.model.switched import Batch, SwitchedAffine, coordinates, switched_system, vary
from gearchaos.quantities import parameter_owner
from gearchaos.validation import check, to_float

_VARIED = {"bodies": ("inertia", "torque", "damping"), "shafts": ("stiffness", "damping", "stop", "stop_back"),
           "meshes": ("stiffness", "damping", "backlash")}
"""The fields of parts that can be set and varied by name, such as ``loose.torque``."""


_OF_FILE = {each.name for kind in (Train, PlanetarySet, Body, Shaft, Mesh) for each in fields(kind)} - {
    "torque", "speed", *itertools.chain(*_VARIED.values())}
"""The fields of a file that cannot be varied."""

_ALIKE = 8  # names that are told of many
_NAMED = 3  # most faults in a sentence
_NEAR = 0.5  # of a natural frequency: a vibration up to it exceeds the static one by a third at most


class _Parameter(NamedTuple):
    kind: str  # field of the train: bodies, shafts or meshes
    owner: str  # name of the part
    field: str
    value: float


@dataclass(frozen=True)
class TrainModel(GearModel):
    """A train at its operating point, with dimensionless initial values by coordinate.

    Without initial values it begins at rest, with the static deflections of its mean torques.
    """

    kind: ClassVar[str] = "train"
    is_operated: ClassVar[bool] = True

    train: Train
    initial: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in self.initial:
            if name not in self.state_names:
                raise unknown_name("initial value of the train", name, self.state_names)
        object.__setattr__(self, "initial", MappingProxyType({n: to_float(f"initial.{n}", v)
                                                              for n, v in self.initial.items()}))

    def __hash__(self) -> int:
        return hash((self.train, tuple(sorted(self.initial.items()))))

    def __reduce__(self) -> tuple[Any, ...]:
        return TrainModel, (self.train, dict(self.initial))

    @property
    def gears(self) -> Train:
        """The train, as models of gears have them."""
        return self.train

    operating_gears = gears

    @property
    def units(self) -> Units:
        """SI values of the units of results."""
        return self.train.reference or units_of(self.train)

    @property
    def state_names(self) -> tuple[str, ...]:
        """The coordinates, for which a train takes initial values and has results."""
        return structure(self.train).names

    coordinate_names = state_names

    @property
    def mesh_names(self) -> tuple[str, ...]:
        """The names of the meshes, and of shafts with stops, of which there are results."""
        return tuple(element.name for element in structure(self.train).contacts)

    @property
    def cycles(self) -> dict[str, int]:
        return self.train.cycles

    def record(self) -> dict[str, Any]:
        return {"train": asdict(self.train), "initial": dict(self.initial)}

    @property
    def zeta(self) -> float:
        """The least damping ratio of its modes in contact."""
        found = modes(self.train)
        return float(found.damping_ratio[found.frequency > 0].min(initial=1.0))

    @property
    def least_damping_in_words(self) -> str:
        """That damping ratio, with the mode and the speeds of the first body at which mesh frequencies meet it."""
        found, train = modes(self.train), self.train
        elastic = np.flatnonzero(found.frequency > 0)
        frequency = float(found.frequency[elastic[found.damping_ratio[elastic].argmin()]])
        orders = sorted({train.mesh_order(mesh) for mesh in train.meshes}, reverse=True)
        met = f", met at {', '.join(f'{frequency / (float(o) * RPM):.4g}' for o in orders)} rpm" * bool(orders)
        return f"{super().least_damping_in_words} of the mode of {frequency / (2 * math.pi):.4g} Hz{met}"

    def resonates(self, speed: float) -> bool:
        """Whether an excitation comes near a natural frequency up to this speed, rpm. Stiffnesses and errors that vary
        along the teeth have all orders; without them there are the orders of torques and motions alone."""
        frequency, orders = modes(self.train).frequency, self.train.excitation_orders().values()
        near = _NEAR * float(frequency[frequency > 0].min(initial=math.inf))
        return bool(self.train.cycles) or float(max(orders)) * speed * RPM > near

    def fastest_in_words(self, rate: float, omega: float) -> str:
        cycles = ", ".join(f"{count} of {name}" for name, count in self.cycles.items())
        period = f"{2 * math.pi / (omega * self.units.rate):.4g} s" + f" (mesh cycles: {cycles})" * bool(cycles)
        return fastest_mode(self.train, period)

    @property
    def law(self) -> DampingLaw:
        """The damping law of meshes and stops, `CONTACT` where they differ."""
        laws = {self.train.law_of(element.mesh) for element in structure(self.train).contacts}
        return laws.pop() if len(laws) == 1 else CONTACT

    @property
    def damping_in_words(self) -> str:
        """Where the dampers of meshes and stops act, by their names where that differs."""
        names: dict[str, list[str]] = {}
        for element in structure(self.train).contacts:
            names.setdefault(self.train.law_of(element.mesh).words, []).append(element.name)
        return next(iter(names)) if len(names) == 1 else "; ".join(
            f"{words}: {', '.join(each)}" for words, each in names.items())

    @property
    def omega(self) -> float:
        """Frequency of the common period over that of the first mesh."""
        return 2 * math.pi / (self.train.period * self.units.rate)

    @property
    def period(self) -> float:
        """The common period in units of τ."""
        return 2 * math.pi / self.omega

    @property
    def in_words(self) -> str:
        """A sentence that says how many coordinates it has, and when everything repeats."""
        train = self.train
        counts = {"body/bodies": len(train.bodies), "shaft/shafts": len(train.shafts),
                  "contact with play/contacts with play": len(structure(train).contacts),
                  "state variable/state variables": len(self.state_names)}
        alike: dict[int, list[str]] = {}  # meshes by how many of their cycles are in the common period
        for name, count in train.cycles.items():
            alike.setdefault(count, []).append(name)
        cycles = ", ".join(
            f"{count} mesh cycle{'s' * (count > 1)} of {' and '.join(names) if len(names) < 3 else names[0]}"
            f"{f' and {len(names) - 1} others' * (len(names) > 2)}" for count, names in alike.items())
        turns = "".join(f" = {n} turn{'s' * (n > 1)} of {name}" for name, n in train.turns.items())
        parts = [f"{count} {words.split('/')[count > 1]}" for words, count in counts.items() if count]
        parts += [f"pairs of tooth {f.tooth} of {mesh.between[f.wheel - 1]} "
                  f"{100 * (1 - f.stiffness_share):.3g} % less stiff"
                  for mesh in train.meshes for f in mesh.faults if f.stiffness_share < 1][:_NAMED]
        return (f"train: {', '.join(parts)}; everything repeats after {train.period * 1e3:.4g} ms"
                f"{' = ' * bool(train.cycles)}{cycles}{turns}, the period of results" + (
                    f"; for that, frequencies are up to {100 * train.deviation:.2g} % off" if train.deviation else ""))

    @property
    def assumptions(self) -> tuple[str, ...]:
        return self.train.assumptions

    @property
    def known_names(self) -> tuple[str, ...]:
        return ("speed", "torque", *self._known, *self.state_names)

    @cached_property
    def _known(self) -> dict[str, _Parameter]:
        """The parameters of parts by name."""
        out: dict[str, _Parameter] = {}
        for kind, names in _VARIED.items():
            for part in getattr(self.train, kind):
                for name in names:
                    springless = isinstance(part, Shaft) and not part.stiffness and not name.startswith("stop")
                    if springless or (isinstance(part, Body) and (
                            part.prescribed or (name == "torque" and part.torque_over_speed))):
                        continue
                    value = getattr(part, name)
                    if isinstance(part, Mesh) and name == "stiffness":
                        value = mean_stiffness(next(
                            e for e in structure(self.train).contacts if e.name == part.name))
                    if value is not None:
                        out[f"{parameter_owner(part.name)}.{name}"] = _Parameter(kind, part.name, name, float(value))
        return out

    def parameters(self) -> dict[str, float]:
        """The value of every parameter by name, in SI, the speed in rpm."""
        return {"speed": self.train.speed, **{name: found.value for name, found in self._known.items()}}

    def expand(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Values by the names of parameters and coordinates; raises `InputError` for a name that there is not."""
        out = {}
        for name, value in values.items():
            owner, dot, own = str(name).rpartition(".")
            found = f"{parameter_owner(owner)}.{own}" if dot else str(name)
            if found not in self.known_names:
                raise self._unknown(str(name))
            out[found] = value
        return out

    def _unknown(self, name: str) -> InputError:
        """The error for a name that is no parameter: the names most like it, and how all are made; of a field of the
        file that cannot be varied that it is to be changed there."""
        _, *own = re.split(r"[.\[]", f".{name}" if "." not in name else name)
        if name.startswith("train.") or _OF_FILE.intersection(own):
            return InputError("parameter", "must be one of those that can be varied", name,
                              "It is of the file: edit it there. Values that are set are named by the part and its "
                              "field, without train.: docs/trains.md, What can be varied.")
        error, alike = unknown_name("parameter", name, self.known_names), difflib.get_close_matches(
            name, self.known_names, _ALIKE, 0.0)
        kinds = "; ".join(f"{', '.join(names)} of {kind}" for kind, names in _VARIED.items())
        return InputError("parameter", f"must be one of {len(self.known_names)}, such as {', '.join(alike)}", name, (
            f"{error.advice} Names are those of parts of the file, with a point and {kinds}; speed, torque, and the "
            "coordinates.").strip())

    def set_by(self, name: str) -> tuple[str, ...]:
        """The names of the single parameters that a name sets."""
        (found,) = self.expand({name: None})
        return tuple(n for n in self._known if n.endswith(".torque")) if found == "torque" else (found,)

    def value(self, name: str) -> float | None:
        """The value of a parameter or of an initial value that is given; None for others."""
        (found,) = self.expand({name: None})
        if found == "torque":
            return self.train.torque
        return {**self.parameters(), **self.initial}.get(found)

    def with_values(self, values: Mapping[str, Any]) -> Self:
        """This model with values replaced by name: ``speed``, also that of another body as a table, ``torque``,
        parameters of parts such as ``loose.torque``, ``damping_law``, and initial values by coordinate."""
        if not values:
            return self
        law = {"damping_law": values["damping_law"]} if "damping_law" in values else {}
        if "kind" in values:
            raise InputError("kind", "must be left out for a train", values["kind"])
        flat = self.expand({n: v for n, v in values.items() if n != "damping_law"})
        initial = {**self.initial, **{n: v for n, v in flat.items() if n in self.state_names}}
        train = replace(self.train, reference=self.units, **law)
        point = {n: flat[n] if n == "speed" and isinstance(flat[n], Mapping) else to_si(n, flat[n], unit)
                 for n, unit in (("speed", SPEED), ("torque", TORQUE)) if n in flat}
        train = train.at(**point) if point else train
        for name, found in ((n, p) for n, p in self._known.items() if n in flat):
            parts = list(getattr(train, found.kind))
            (i,) = (i for i, part in enumerate(parts) if part.name == found.owner)
            try:
                if found.field == "stiffness" and isinstance(parts[i], Mesh):  # one that varies keeps its form
                    parts[i] = parts[i].with_mean_stiffness(flat[name], found.value)
                else:
                    parts[i] = replace(parts[i], **{found.field: flat[name]})
                if not isinstance(part := parts[i], Body):
                    parts[i] = replace(part, assumed={n: text for n, text in part.assumed.items() if n != found.field})
            except InputError as error:
                raise InputError(field_of(parts[i], error.field), error.rule, error.value, error.advice) from None
            train = train.unbalanced(**{found.kind: tuple(parts)})
        train.check_balance()
        return replace(self, train=train, initial=initial)


@dataclass(frozen=True)
class TrainBatch(Batch):
    """A train with some of its values replaced by arrays of one length P: P parameter points."""

    model: TrainModel
    values: Mapping[str, np.ndarray]  # (P,), by the names of parameters and coordinates
    size: int

    @cached_property
    def assembly(self) -> Assembly:
        train, load = self.model.train, self.values.get("torque")
        tables = {body.name: body for body in train.bodies if body.torque_over_speed}

        def value(owner: str, name: str, given: float) -> np.ndarray:
            found = self.values.get(f"{parameter_owner(owner)}.{name}")
            if found is None and load is not None and name == "torque":
                return given * load / train.torque
            if found is None and name == "torque" and owner in tables and "speed" in self.values:
                return train.torque_at(tables[owner], self.values["speed"])
            return np.array([given], float) if found is None else found

        speed = np.broadcast_to(np.asarray(self.values.get("speed", train.speed), float), self.size)
        return Assembly(structure(train), self.model.units, value, speed)


@vary.register
def _(model: TrainModel, values: Mapping[str, Any]) -> TrainBatch:
    flat = {k: np.atleast_1d(np.asarray(v, dtype=float)) for k, v in model.expand(values).items()}
    sizes = {v.shape for v in flat.values()} or {(1,)}
    if len(sizes) > 1 or any(len(s) != 1 for s in sizes):
        raise InputError("values", "must be one-dimensional arrays of one common length", sorted(sizes))
    for name, value in flat.items():
        check(name, value)
    if "torque" in flat:
        model.train.at(torque=1.0)  # raises if there is none that can be varied
    found = structure(model.train)
    for name in flat:
        if name in {f"{parameter_owner(body.name)}.damping" for body in found.free} and (
                found.rigid.shape[1] > found.turning.shape[1]):
            raise InputError(name, "must be varied where a body has damping", 0.0, "Otherwise the speed of turning as "
                             "a whole is no coordinate. Give one a damping greater than 0.")
    batch = TrainBatch(model, MappingProxyType(flat), next(iter(sizes))[0])
    left, size = found.imbalance(batch.assembly.value)
    wrong = np.flatnonzero(np.any(np.abs(left) > BALANCE * size, axis=1))
    if "speed" in flat and len(wrong) and any(body.torque_over_speed for body in model.train.bodies):
        raise InputError("torque_over_speed", "must leave the mean torques in balance at each speed",
                         f"torques that do not at {flat['speed'][wrong[0]]:.6g} rpm",
                         "Give each load its torque at every speed, or prescribe the motion of a body.")
    for name in (n for n in flat if n.endswith(".torque") and len(wrong)):
        raise InputError(name, "must leave the mean torques in balance", float(flat[name][wrong[0]]),
                         "Vary torque, which changes all mean torques in one ratio.")
    return batch


@coordinates.register
def _(batch: TrainBatch) -> tuple[str, ...]:
    return structure(batch.model.train).names


@switched_system.register
def _(batch: TrainBatch, names: tuple[str, ...] | None = None) -> SwitchedAffine:
    return batch.assembly.system()


@initial_state.register
def _(batch: TrainBatch, system: SwitchedAffine) -> np.ndarray:
    w = batch.assembly.at_rest()
    for i, name in enumerate(system.names):
        given = batch.values.get(name, batch.model.initial.get(name))
        if given is not None:
            w[:, i] = given
    return w


@transmission_error_at_start.register
def _(batch: TrainBatch) -> tuple[np.ndarray, np.ndarray]:
    return np.zeros(batch.size), np.zeros(batch.size)


@mesh_rotation.register
def _(batch: TrainBatch, names: tuple[str, ...], w: np.ndarray, share: np.ndarray, mesh: int) -> np.ndarray:
    return batch.assembly.mesh_rotation(w, share, mesh)


@prescribed_rates_at_start.register
def _(batch: TrainBatch, names: tuple[str, ...]) -> np.ndarray:
    return batch.assembly.prescribed_rates()


@to_physical.register
def _(batch: TrainBatch, names: tuple[str, ...], w: np.ndarray, *_: Any) -> dict[str, np.ndarray]:
    return {name: w[..., i] for i, name in enumerate(names)}
