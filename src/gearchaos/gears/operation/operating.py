"""Models of given gears, in which the speed and the torque of wheel 1 are parameters that can be set and varied."""

from __future__ import annotations

import json
import math
import warnings
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Protocol, Self, TypeAlias, TypeGuard

import numpy as np

from gearchaos.errors import DesignWarning, InputError
from gearchaos.gears.io.units import RPM, SPEED, TORQUE, to_si
from gearchaos.gears.mesh.pair import GearPair
from gearchaos.model import PARAMETER_PAIRS, SUPPORTS, GearModel, MeshModel, has_effect
from gearchaos.quantities import OPERATION
from gearchaos.validation import check, to_float

if TYPE_CHECKING:
    from gearchaos.gears.design.gear_design import GearDesign
    from gearchaos.gears.train.train import Train

# the parameters of given gears beside those of the model: the speed in rpm and the torque in N m of wheel 1
OPERATING_NAMES = tuple(q.name for q in OPERATION)
# the parameters that the speed and the torque set if the reference stiffness is constant; where it depends on the
# torque, the torque also changes the parameters that follow from it
_SET_BY = {"speed": ("omega",), "torque": ("q1", "q2")}
# what studies take as their model: a dimensionless model, or gears at an operating point
AnyModel: TypeAlias = "MeshModel | GearPair | GearDesign | Train"


class Gears(Protocol):
    """Gears at an operating point, values: a `GearPair` or a `GearDesign`."""

    def __hash__(self) -> int: ...
    def at(self, *, speed: float | None = None, torque: float | None = None) -> Self: ...
    @property
    def warnings(self) -> tuple[str, ...]: ...
    def to_pair(self) -> GearPair: ...
    def to_model(self, kind: str | None = None) -> MeshModel: ...


@dataclass(frozen=True)
class OperatingModel(MeshModel):
    """A model of gears at its operating point, with two more parameters: speed, rpm, and torque, N m, of wheel 1."""

    is_operated: ClassVar[bool] = True
    gears: Any = None

    def __hash__(self) -> int:
        return hash((super().__hash__(), self.gears))

    def __repr__(self) -> str:
        return f"Operating{super().__repr__().removeprefix('Mesh')[:-1]}, gears={self.gears!r})"

    def set_by(self, name: str) -> tuple[str, ...]:
        return _SET_BY[name] if name in OPERATING_NAMES else super().set_by(name)

    def value(self, name: str) -> float | None:
        return getattr(self, f"_{name}") if name in OPERATING_NAMES else super().value(name)

    @property
    def _speed(self) -> float:
        """Speed of wheel 1 in rpm that ω stands for."""
        pair, parameters = _point(self.gears, None)
        return pair.speed if self.omega == parameters["omega"] else self.omega * pair.omega0 / pair.n1 / RPM

    @property
    def _torque(self) -> float:
        """Torque at wheel 1 in N m that q1 stands for, at the reference stiffness of the gears."""
        own = _point(self.gears, None)
        return own.pair.M10 if self.q1 == own.parameters["q1"] else self.q1 * own.pair.scales.torque1

    @property
    def operating_gears(self) -> Gears:
        """The gears at the speed and torque of the model, which may have been set as ω and q1.

        The torque stays that of the gears if their model at the other torque would differ: if the reference stiffness
        depends on the torque, or q1 and q2 are not in the ratio of the gears. Results are in the units of the reference
        stiffness in both cases.
        """
        gears, own = self.gears, _point(self.gears, None).pair
        if self._speed != own.speed:
            gears = gears.at(speed=self._speed)
        if self._torque == own.M10:
            return gears
        try:
            there = _point(self.gears, self._torque)
        except InputError:  # a torque that the gears cannot have
            return gears
        same = there.pair.scales == own.scales and math.isclose(there.parameters["q2"], self.q2, rel_tol=1e-12)
        return gears.at(torque=self._torque) if same else gears

    def expand(self, values: Mapping[str, Any]) -> dict[str, Any]:
        operation, rest = _separated(values)
        return {**self._operating_values(**operation), **super().expand(rest)}

    def with_values(self, values: Mapping[str, Any]) -> Self:
        operation, rest = _separated(values)
        model = self
        if "damping_law" in rest:  # of the gears, too
            model = replace(self, gears=replace(self.gears, damping_law=rest["damping_law"]))
            if is_design(self.gears) and model.gears.shares_load != self.gears.shares_load:
                raise InputError("damping_law", "must be set in the design, whose load sharing depends on it",
                                 rest["damping_law"], "With unilateral the mesh is one spring: load_sharing = "
                                 "'prescribed' is that with any law.")
        if operation:  # before the kind is set: supports depend on the torque
            point = {n: operating_value(n, v) for n, v in operation.items()}
            changed = {n: v.item() for n, v in self._operating_values(**point).items()}
            model = replace(super(OperatingModel, model).with_values(changed), gears=model.gears.at(**point))
        given = {single for name in rest for single in PARAMETER_PAIRS.get(name, (name,))}
        supports = {f"{family}{n}" for family in SUPPORTS for n in (1, 2)}
        if rest.get("kind") == "full" and self.kind != "full" and not given >= supports:
            # those of the gears, with an error where these are rigid
            rest = {**_point(model.gears, None).pair.lateral_parameters(), **rest}
        return super(OperatingModel, model).with_values(rest)

    def _operating_values(self, speed: Any = None, torque: Any = None) -> dict[str, np.ndarray]:
        """The parameters that a speed, rpm, and a torque, N m, set, arrays (P,) by name.

        A speed or torque that is left out is that of the gears. A parameter that was given another value than that of
        the gears, such as ζ, keeps it at every torque.
        """
        if speed is None and torque is None:
            return {}
        for name, values in (("speed", speed), ("torque", torque)):
            if values is not None:
                check(name, values)
        own, given = _point(self.gears, None), () if torque is None else _SET_BY["torque"]
        different, index = np.unique(np.atleast_1d(np.nan if torque is None else torque), return_inverse=True)
        kept = {n for n, v in self.parameters().items() if n in own.parameters and v != own.parameters[n]}
        points = [own] if torque is None else [_point(self.gears, value) for value in different.tolist()]
        changed = {*given, *({n for p in points for n, v in p.parameters.items() if v != own.parameters[n]} - kept)}
        out = {n: np.array([p.parameters[n] for p in points])[index] for n in sorted(changed)
               if has_effect(n, self.kind)}
        if speed is not None:
            omega0 = np.array([p.pair.omega0 for p in points])[index]
            out["omega"] = own.pair.n1 * (np.asarray(speed, float) * RPM) / omega0
        return out


def operating_value(name: str, value: Any) -> float:
    """A speed in rpm or a torque in N m, from a number in these units or a text with another unit."""
    if isinstance(value, str):
        return to_si(name, value, SPEED if name == "speed" else TORQUE)
    return to_float(name, value)


def _separated(values: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """The values of `OPERATION`, and the others, each by name."""
    own = {n: v for n, v in values.items() if n in OPERATING_NAMES}
    return own, {n: v for n, v in values.items() if n not in own}


class _Point(NamedTuple):
    """Gears at one torque in N m, or at their own: their pair, and the parameters of their model by name."""

    pair: GearPair
    parameters: dict[str, float]


@lru_cache(maxsize=4096)
def _point(gears: Gears, torque: float | None) -> _Point:
    there = gears if torque is None else gears.at(torque=torque)
    return _Point(there.to_pair(), there.to_model().parameters())


def pair_of(gears: Any, torque: float | None = None) -> GearPair:
    """The pair of gears, at another torque of wheel 1 in N m if one is given; computed once for each torque."""
    if is_train(gears):  # its units are the same at all torques
        return gears  # type: ignore[return-value]
    return _point(gears, torque).pair


def operating_model(gears: Gears, kind: str | None = None) -> OperatingModel:
    """The model of gears at their operating point; ``kind`` as in `GearPair.to_model`."""
    return with_gears(gears.to_model(kind), gears)


def with_gears(model: MeshModel, gears: Gears) -> OperatingModel:
    """A dimensionless model of gears as an `OperatingModel`."""
    return OperatingModel(**{f.name: getattr(model, f.name) for f in fields(model)}, gears=gears)


def is_design(value: Any) -> TypeGuard[GearDesign]:
    """Whether a value is a `GearDesign`, whose modules are imported only if it is no `MeshModel` and no `GearPair`."""
    if isinstance(value, (MeshModel, GearPair)):
        return False
    from gearchaos.gears.design.gear_design import GearDesign

    return isinstance(value, GearDesign)


def is_train(value: Any) -> TypeGuard[Train]:
    """Whether a value is a `Train`, whose modules are imported only if it is nothing else."""
    if isinstance(value, (MeshModel, GearPair)) or type(value).__name__ != "Train":
        return False
    from gearchaos.gears.train.train import Train

    return isinstance(value, Train)


def gears_json(gears: Gears) -> str:
    """All fields of gears as JSON, from which `gears_from_json` makes equal gears."""
    kind = "train" if is_train(gears) else "design" if is_design(gears) else "pair"
    return json.dumps({kind: asdict(gears)})  # type: ignore[call-overload]


def gears_from_json(text: str) -> Any:
    """The gears that `gears_json` wrote; raises `InputError` for anything else."""
    try:
        ((kind, values),) = json.loads(text).items()
        if kind == "pair":
            return GearPair(**values)
        if kind == "train":
            from gearchaos.gears.train.train import Train

            return Train(**values)
        from gearchaos.gears.design.gear_design import GearDesign  # many modules, for designs alone

        return {"design": GearDesign}[kind](**values)
    except (AttributeError, KeyError, RecursionError, TypeError, ValueError) as error:
        raise InputError("dataset", "must carry its gears as JSON", text,
                         f"Compute it again, or load the file that was saved. ({error})") from error


def gears_of(model: MeshModel) -> Gears | None:
    """The gears of a model; None if it is dimensionless."""
    return getattr(model, "gears", None)


def model_of_gears(gears: Any, kind: str | None = None) -> Any:
    """What studies take gears for: an `OperatingModel`, or a `TrainModel` of a train and of a design in which something
    repeats once per turn; ``kind`` as in `GearPair.to_model`."""
    turning = is_design(gears) and gears.turning
    if not (turning or is_train(gears)):
        return operating_model(gears, kind)
    from gearchaos.gears.train.model import TrainModel  # many modules, for trains alone

    return TrainModel(gears.to_train() if turning else gears)


def as_model(model: Any) -> MeshModel:
    """A model itself, or that of gears; raises `InputError` for anything else."""
    if is_design(model) or isinstance(model, GearPair) or is_train(model):
        found: Any = model_of_gears(model)
        for text in dict.fromkeys((*model.warnings, *found.gears.warnings)):
            warnings.warn(text, DesignWarning, stacklevel=1)  # one place for all studies: Python shows each text once
        return found
    if not isinstance(model, GearModel):
        rule = "must be a MeshModel, a GearPair, a GearDesign or a Train"
        raise InputError("model", rule, f"a {type(model).__name__}", "E.g. gearchaos.MeshModel.of(omega=1, eps1=0.1).")
    return model  # type: ignore[return-value]
