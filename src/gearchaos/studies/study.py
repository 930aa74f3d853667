"""What all studies have in common: a frozen value that knows its work items and how to compute them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field, fields
from types import NoneType
from typing import Any, ClassVar, Self, get_args, get_type_hints

import numpy as np
import xarray as xr

from gearchaos.dynamics import Classification
from gearchaos.dynamics.settings import as_settings
from gearchaos.errors import InputError, unknown_name
from gearchaos.gears.pair import as_model
from gearchaos.model import MeshModel
from gearchaos.studies.cost import Cost


def option(
    default: Any, text: str, *, least: int | None = None, metavar: str | None = None, keyword: bool = True
) -> Any:
    """A field of a study that study files and the command line can set.

    Parameters
    ----------
    default
        The value where none is given; `dataclasses.MISSING` where one must be given.
    text : str
        One line of help.
    least : int, optional
        Smallest value of a whole number.
    metavar : str, optional
        How the help of the command line shows the value.
    keyword : bool
        Whether it can be given by name alone.
    """
    metadata = {"help": text, "least": least, "metavar": metavar}
    return field(default=default, kw_only=keyword, metadata=metadata)


def _without_none(annotation: Any) -> Any:
    """The type of a field that may be None."""
    types = [t for t in get_args(annotation) if t is not NoneType]
    return types[0] if NoneType in get_args(annotation) else annotation


@dataclass(frozen=True)
class Study(ABC):
    """A study: a frozen, validated value.

    It consists of work items on a grid: cells, columns, starts or single motions. They can be computed in any order and
    anywhere; the result of an item does not depend, bit for bit, on the items that are computed with it.

    To add a kind of study, write a subclass in a file of its own and name it in `gearchaos.studies.registry`. Its
    fields are the specification: study files, stores and the command line read them. `__post_init__` raises
    `InputError` for whatever is wrong with them, before any work. The class gives ``kind``, the names of its axes, the
    ``grid``, the ``cost``, and `compute` and `finish`.

    Attributes
    ----------
    kind : str
        Name in study files, stores and commands.
    axis_fields : tuple of str
        Fields that are axes, in the order of the arguments.
    gridded : bool
        Whether the Dataset holds just the arrays of `compute` over the grid, so that it can be had before all items
        are done.
    """

    kind: ClassVar[str]
    axis_fields: ClassVar[tuple[str, ...]] = ()
    gridded: ClassVar[bool] = False

    model: MeshModel

    def __post_init__(self) -> None:
        self._set(model=as_model(self.model))

    @property
    @abstractmethod
    def grid(self) -> dict[str, int]:
        """Names and sizes of the dimensions of the grid of work items, which are numbered along rows."""

    @property
    def block(self) -> dict[str, int]:
        """Smallest number of items along each dimension that are computed together; a sweep needs a whole row."""
        return dict.fromkeys(self.grid, 1)

    @property
    def motions_per_item(self) -> float:
        """About how many motions are followed for an item."""
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
        """The Dataset, from the arrays (N, ...) of all items."""

    @property
    def count(self) -> int:
        """Number of work items."""
        return int(np.prod(list(self.grid.values())))

    def run(self, *, progress: bool = False, threads: int | None = None) -> xr.Dataset:
        """The Dataset of the whole study, computed in memory.

        Parameters
        ----------
        progress : bool
            Show progress on stderr, and say before if it may take long.
        threads : int, optional
            Tiles computed at once; by default one per core.
        """
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
        """A study from values by field; raises `InputError` where one is missing, unknown or wrong."""
        known = {f.name: f for f in fields(cls)}
        for name in values:
            if name not in known:
                raise unknown_name("study option", name, known.keys() - {"model"})
        for name, f in known.items():
            if name not in ("model", *values) and f.default is MISSING and f.default_factory is MISSING:
                raise InputError(f"study.{name}", "must be given", None, f"A study of kind {cls.kind!r} needs it.")
        return cls(model, **values)

    def __getstate__(self) -> dict[str, Any]:
        """The fields alone: what was derived from them is derived again."""
        return {f.name: getattr(self, f.name) for f in fields(self)}

    def _set(self, **values: Any) -> None:
        """Set fields of the frozen value while it is made."""
        for name, value in values.items():
            object.__setattr__(self, name, value)


@dataclass(frozen=True)
class ClassifyingStudy(Study):
    """A study that says of every motion what kind it is.

    Attributes
    ----------
    default_settings : Classification
        The classification settings where none are given.
    settings : Classification
        Those of this study.
    """

    default_settings: ClassVar[Classification] = Classification()

    settings: Classification | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        self._set(settings=as_settings(self.settings) or self.default_settings)

    @property
    def classification(self) -> Classification:
        """The settings, which are known once the study is made."""
        return self.settings or self.default_settings
