"""Base classes of all studies: frozen values that define work items and how to compute them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import MISSING, asdict, dataclass, field, fields
from types import NoneType
from typing import TYPE_CHECKING, Any, ClassVar, Self, get_args, get_type_hints

import numpy as np

from gearchaos.datasets import provenance
from gearchaos.display import HasCard
from gearchaos.dynamics import Classification
from gearchaos.dynamics.settings import as_settings
from gearchaos.errors import InputError, unknown_name, whole_number
from gearchaos.gears.operating import Gears, OperatingModel, as_model
from gearchaos.model import MeshModel
from gearchaos.quantities import OPERATION
from gearchaos.studies.axis import Axis, as_axis
from gearchaos.studies.cost import Cost
from gearchaos.studies.operating_point import at_axis_starts, check_speed_axes

if TYPE_CHECKING:
    import xarray as xr


def option(default: Any, *, least: int | None = None, keyword: bool = True) -> Any:
    """A field of a study that study files can set.

    Parameters
    ----------
    default
        The value if none is given; `dataclasses.MISSING` if one must be given.
    least : int, optional
        Smallest value of a whole number.
    keyword : bool
        Whether it is a keyword-only argument.
    """
    return field(default=default, kw_only=keyword, metadata={"least": least})


def _without_none(annotation: Any) -> Any:
    """An annotation without the alternative None."""
    types = [t for t in get_args(annotation) if t is not NoneType]
    return types[0] if NoneType in get_args(annotation) else annotation


@dataclass(frozen=True)
class Study(HasCard, ABC):
    """A study: a frozen, validated value.

    It consists of work items on a grid: cells, columns, initial states or single motions. They can be computed in any
    order and anywhere; the result of an item does not depend, bit for bit, on the items that are computed with it.

    To add a kind of study, write a subclass in a file of its own and name it in `gearchaos.studies.registry`. Its
    fields are the specification of the study, which study files and stores read. `__post_init__` raises
    `InputError` for invalid values, before any work. The class defines ``kind``, ``axis_fields``, ``grid``, ``cost``,
    `compute` and `finish`. A command of its own goes into `gearchaos.cli`.

    Attributes
    ----------
    kind : str
        Name in study files, stores and commands.
    axis_fields : tuple of str
        Names of the fields that are axes, in the order of the arguments.
    gridded : bool
        Whether the variables of the Dataset are the arrays of `compute` over the grid, so that a Dataset can be made
        before all items are computed.
    """

    kind: ClassVar[str]
    axis_fields: ClassVar[tuple[str, ...]] = ()
    gridded: ClassVar[bool] = False

    model: MeshModel

    def __post_init__(self) -> None:
        axes = [as_axis(getattr(self, name), name) for name in self.axis_fields]
        self._set(model=as_model(at_axis_starts(self.model, axes)))
        check_speed_axes(self.model, axes)

    @property
    @abstractmethod
    def grid(self) -> dict[str, int]:
        """Sizes of the dimensions of the grid of work items by name; items are numbered in row-major order."""

    @property
    def block(self) -> dict[str, int]:
        """Smallest number of items along each dimension that must be computed together: for a sweep a whole row."""
        return dict.fromkeys(self.grid, 1)

    @property
    def motions_per_item(self) -> float:
        """Estimate of the number of motions that are followed for each item."""
        return 1

    @property
    @abstractmethod
    def cost(self) -> Cost:
        """Upper bound of the computing time and memory."""

    @abstractmethod
    def compute(
        self, items: np.ndarray, *, progress: bool = False, threads: int | None = None
    ) -> dict[str, np.ndarray]:
        """Results of the items with these numbers (L,), arrays (L, ...) by name."""

    @abstractmethod
    def finish(
        self, found: dict[str, np.ndarray], *, progress: bool = False, threads: int | None = None
    ) -> xr.Dataset:
        """The Dataset, from the results of `compute` for all items, arrays (N, ...) by name."""

    @property
    def count(self) -> int:
        """Number of work items."""
        return int(np.prod(list(self.grid.values())))

    def run(self, *, progress: bool = False, threads: int | None = None) -> xr.Dataset:
        """The Dataset of the whole study, computed in memory.

        Parameters
        ----------
        progress : bool
            Show progress on stderr, and announce a computing time that may be long.
        threads : int, optional
            Tiles computed at once; by default one per core.
        """
        threads = None if threads is None else whole_number("threads", threads, 1)
        self.cost.announce(progress, threads)
        items = np.arange(self.count, dtype=np.int32 if self.count < 2**31 else np.int64)
        found = self.compute(items, progress=progress, threads=threads)
        return self.finish(found, progress=progress, threads=threads)

    @classmethod
    def option_types(cls) -> dict[str, Any]:
        """Types, without None, of the fields besides the model, the axes and the classification settings."""
        types, own = get_type_hints(cls), ("model", "settings", *cls.axis_fields)
        return {f.name: _without_none(types[f.name]) for f in fields(cls) if f.name not in own}

    @classmethod
    def of(cls, model: MeshModel, values: Mapping[str, Any]) -> Self:
        """A study from the values of its fields by name; raises `InputError` if one is missing, unknown or invalid."""
        known = {f.name: f for f in fields(cls)}
        for name in values:
            if name not in known:
                raise unknown_name("study option", name, known.keys() - {"model"})
        for name, f in known.items():
            if name not in ("model", *values) and f.default is MISSING and f.default_factory is MISSING:
                raise InputError(f"study.{name}", "must be given", None, f"A study of kind {cls.kind!r} needs it.")
        return cls(model, **values)

    @property
    def gears(self) -> Gears | None:
        """The gears on which the result depends besides the model: those of an axis ``speed`` or ``torque``."""
        varied = {axis.name for axis in self._axes()} & {q.name for q in OPERATION}
        return self.model.gears if varied and isinstance(self.model, OperatingModel) else None

    def provenance(self, **settings: Any) -> dict[str, Any]:
        """Attributes of the Dataset: study, model and its gears, the settings given here, and versions."""
        torque = [axis for axis in self._axes() if axis.name == "torque"]
        if torque:  # by which `physical` recognises a result from which the coordinate was dropped
            settings["torque_range"] = [torque[0].start, torque[0].stop]
        return provenance(self.kind, self.model, **settings)

    def _axes(self) -> list[Axis]:
        """All fields that are axes."""
        return [value for f in fields(self) if isinstance(value := getattr(self, f.name), Axis)]

    def __getstate__(self) -> dict[str, Any]:
        """The fields alone; cached properties are computed again from them."""
        return {f.name: getattr(self, f.name) for f in fields(self)}

    def _whole_numbers(self, *names: str) -> dict[str, int | None]:
        """Values of these options by name; raises `InputError` unless they are whole numbers of at least ``least``.

        None is accepted where it is the default.
        """
        out, declared = {}, {f.name: f for f in fields(self)}
        for name in names:
            value, declaration = getattr(self, name), declared[name]
            omitted = value is None and declaration.default is None
            out[name] = None if omitted else whole_number(name, value, declaration.metadata["least"])
        return out

    def _set(self, **values: Any) -> None:
        """Set fields of the frozen value in `__post_init__`."""
        for name, value in values.items():
            object.__setattr__(self, name, value)


@dataclass(frozen=True)
class ClassifyingStudy(Study):
    """A study that classifies motions.

    Attributes
    ----------
    default_settings : Classification
        The classification settings if none are given.
    settings : Classification
        The classification settings of this study.
    """

    default_settings: ClassVar[Classification] = Classification()

    settings: Classification | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        self._set(settings=as_settings(self.settings) or self.default_settings)

    @property
    def classification(self) -> Classification:
        """The settings, which `__post_init__` has set where none were given."""
        return self.settings or self.default_settings

    def provenance(self, **settings: Any) -> dict[str, Any]:
        """As that of every study, with the classification settings."""
        return super().provenance(**settings, classification=asdict(self.classification))
