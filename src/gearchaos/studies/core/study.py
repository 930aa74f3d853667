"""Base classes of all studies: frozen values that define work items and how to compute them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import MISSING, Field, asdict, dataclass, field, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from gearchaos.datasets import from_netcdf_bytes, netcdf_bytes, new_dataset, provenance, variable
from gearchaos.display import HasCard
from gearchaos.dynamics import Classification
from gearchaos.dynamics.response import MESH, MeshResponse
from gearchaos.dynamics.settings import as_settings
from gearchaos.errors import InputError, unknown_name, whole_number
from gearchaos.gears.operation.operating import Gears, as_model, gears_of
from gearchaos.model import MeshModel, vary
from gearchaos.model.switched import switched_system
from gearchaos.plugins import versions_of
from gearchaos.quantities import OPERATION, Quantity, declare_results, quantity
from gearchaos.studies.core.axis import Axis, at_axis_starts, check_speed_axes
from gearchaos.studies.core.cost import Cost, estimate
from gearchaos.studies.core.options import Option, options_of
from gearchaos.studies.core.price import announce

if TYPE_CHECKING:
    import xarray as xr


def mesh_coordinate(model: Any) -> dict[str, Any]:
    """The names of the meshes of a train, as the coordinate of results over them; none of a pair."""
    return {MESH: variable(MESH, (MESH,), np.array(model.mesh_names))} if model.mesh_names else {}


_LEAST = 8
"""Least number of values of an axis of a thinned study."""

Results = dict[str, np.ndarray]
"""Results of work items: arrays (L, ...) by name."""

PROGRESS = Option("progress", "bool", False, "Show progress on stderr, and tell a long computing time before the work.")
THREADS = Option("threads", "int | None", None, "Tiles computed at once; by default one per core.")


@dataclass(frozen=True)
class Study(HasCard, ABC):
    """A study: a frozen, validated value.

    It consists of work items on a grid: cells, columns, initial states or single motions. They can be computed in any
    order and anywhere; the result of an item does not depend, bit for bit, on the items that are computed with it.

    To add a kind of study, write a subclass in a file of its own, and below it ``name = function_of(Name)``. Its fields
    are its specification, each with its default, its rule and its words (`options.option`, `options.axis`); its
    docstring says what it finds, with an example of the function, and one of the class under "As a value": a small
    study, which the manual runs. ``python -m gearchaos.studies.core.generate`` then writes what follows from it: the
    public names, the stub for type checkers, its command, its entry in the manual. Study files and stores read the
    fields. `__post_init__` raises `InputError` for what no single field shows to be wrong, before any work. The class
    defines ``kind``, `cost`, `compute`, and `finish` unless it is gridded; ``grid`` if its work items are not the
    values of its axes.

    Attributes
    ----------
    kind : str
        Name in study files, stores and commands.
    rank : int
        Its place in lists of studies: in the order in which they are used.
    axis_fields : tuple of str
        Names of the fields that are axes, in the order of the arguments.
    gridded : bool
        Whether the variables of the Dataset are the arrays of `compute` over the grid, so that a Dataset can be made
        before all items are computed.
    item_dims : tuple of str
        Dimensions of the results of one work item of a gridded study.
    needs_out : bool
        Whether its command must be given a file for its result.
    group : str
        The group of commands in which the help of the program lists it.
    quantities : tuple of Quantity
        Those of its variables that no result had before.
    variables : tuple of str
        Names of variables of its result, all that are known before it is computed: a gridded study has some, and one
        whose summary is a map has ``contact``. A name of no quantity is refused when the class is made.
    summary : str
        What its command prints: a name in `gearchaos.cli.summaries`.
    returns : str
        What its function returns.
    model_words : str
        What the argument ``model`` means, where the axes do not say it.
    run_options : tuple of Option
        The options of its function that are none of the study: they do not change the result.
    """

    kind: ClassVar[str]
    rank: ClassVar[int] = 100
    axis_fields: ClassVar[tuple[str, ...]] = ()
    gridded: ClassVar[bool] = False
    item_dims: ClassVar[tuple[str, ...]] = ()
    needs_out: ClassVar[bool] = False
    group: ClassVar[str] = "Motions"
    quantities: ClassVar[tuple[Quantity, ...]] = ()
    variables: ClassVar[tuple[str, ...]] = ()
    summary: ClassVar[str] = "result"
    returns: ClassVar[str] = "xr.Dataset"
    model_words: ClassVar[str] = ""
    run_options: ClassVar[tuple[Option, ...]] = (PROGRESS, THREADS)

    model: MeshModel

    def __init_subclass__(cls) -> None:
        own = (name for name, value in vars(cls).items() if isinstance(value, Field) and value.metadata.get("is_axis"))
        cls.axis_fields = (*cls.axis_fields, *own)
        declare_results(cls.quantities)
        for name in cls.variables:
            quantity(name)
        needed = ("contact",) if cls.summary == "map" else cls.variables or ("",) if cls.gridded else ()
        if not set(needed) <= set(cls.variables):
            raise InputError(f"{cls.__name__}.variables", f"must have {needed[0] or 'names'}", cls.variables,
                             "A gridded study names its variables; the summary of a map shows contact.")

    def __post_init__(self) -> None:
        self._set(**{name: each.checked(getattr(self, name)) for name, each in options_of(type(self)).items()})
        self._set(model=as_model(at_axis_starts(self.model, self.axes)))
        check_speed_axes(self.model, self.axes)

    @property
    def axes(self) -> tuple[Axis, ...]:
        """The axes, in the order of the arguments."""
        return tuple(getattr(self, name) for name in self.axis_fields)

    @property
    def grid(self) -> dict[str, int]:
        """Sizes of the dimensions of the grid of work items by name; items are numbered in row-major order.

        By default they are the values of the axes, the last axis first, or a single motion.
        """
        return {axis.name: axis.count for axis in reversed(self.axes)} or {"motion": 1}

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

    def estimate(self, motions: int, periods: int, sequential: int = 0, samples: int = 0) -> Cost:
        """`cost.estimate` for motions at the operating point of the model."""
        return estimate(switched_system(vary(self.model, {})), motions, periods, sequential, samples, model=self.model)

    def thinned(self, share: float) -> Self:
        """About this share of the study, for its `price`: fewer values of each axis, over the same range."""
        by_axis = share ** (1 / max(1, len(self.axes)))
        fewer: dict[str, Any] = {
            name: replace(axis, count=min(axis.count, max(_LEAST, round(by_axis * axis.count))))
            for name, axis in zip(self.axis_fields, self.axes, strict=True)}
        return replace(self, **fewer)

    def needed(self, found: Any) -> float:
        """All of the bound."""
        return 1.0

    def tells(self, found: Any) -> bool:
        """Always: its parts are alike."""
        return True

    def smaller(self, share: float) -> tuple[str, Self] | None:
        """`thinned` with the words by which a user asks for it; None where nothing is smaller."""
        less = self.thinned(share)
        words = []
        for name in options_of(type(self)):
            new = getattr(less, name)
            if isinstance(new, Axis) and new != getattr(self, name):
                words.append(f"{new.name}={new.start:g}:{new.stop:g}:{new.count}")
            elif isinstance(new, int | float) and not isinstance(new, bool) and new < getattr(self, name):
                words.append(f"--{name} {new:g}")
        return (" and ".join(words), less) if words else None

    @abstractmethod
    def compute(self, items: np.ndarray, *, progress: bool = False, threads: int | None = None) -> Results:
        """Results of the items with these numbers (L,), arrays (L, ...) by name."""

    def finish(self, found: Results, *, progress: bool = False, threads: int | None = None) -> xr.Dataset:
        """The Dataset, from the results of `compute` for all items, arrays (N, ...) by name."""
        shape = tuple(self.grid.values())
        data = {n: v.reshape(*shape, *v.shape[1:]) for n, v in found.items()}
        coords = {axis.name: variable(axis.name, (axis.name,), axis.values) for axis in self.axes}
        of_items = {n: (MESH,) if n in MeshResponse.declared() else self.item_dims for n in data}
        return new_dataset({n: variable(n, (*self.grid, *of_items[n])[: v.ndim], v) for n, v in data.items()},
                           coords | mesh_coordinate(self.model), self.provenance(**self.recorded))

    @property
    def recorded(self) -> dict[str, Any]:
        """The options that the attributes of the Dataset name besides model, axes and classification settings."""
        return {}

    @property
    def count(self) -> int:
        """Number of work items."""
        return int(np.prod(list(self.grid.values())))

    def check_in_memory(self) -> None:
        """Raise `InputError` unless this machine can compute the whole study and hold all results in its memory.

        A study whose Dataset is made only from all results calls this when it is created. For a gridded study only
        `run` does: a store of it may be larger than the memory, and may be computed by many machines.
        """
        self.cost.check_time()

    def run(self, *, progress: bool = False, threads: int | None = None) -> xr.Dataset:
        """The Dataset of the whole study, computed in memory.

        Parameters
        ----------
        progress : bool
            Show progress on stderr, and tell a long computing time before the work.
        threads : int, optional
            Tiles computed at once; by default one per core.
        """
        threads = None if threads is None else whole_number("threads", threads, 1)
        self.check_in_memory()
        announce(self, progress, threads)
        items = np.arange(self.count, dtype=np.int32 if self.count < 2**31 else np.int64)
        found = self.compute(items, progress=progress, threads=threads)
        return self.finish(found, progress=progress, threads=threads)

    def result(self, **run_options: Any) -> Any:
        """What the function of the study returns; ``run_options`` are those of the class."""
        return self.run(**run_options)

    @classmethod
    def option_types(cls) -> dict[str, Any]:
        """Types, without None, of the options besides the axes and the classification settings."""
        return {n: o.type for n, o in options_of(cls).items() if not o.is_axis and n != "settings"}

    @classmethod
    def of(cls, model: MeshModel, values: Mapping[str, Any]) -> Self:
        """A study from the values of its fields by name; raises `InputError` if one is missing, unknown or invalid."""
        known = options_of(cls)
        for name in values:
            if name not in known:
                raise unknown_name("study option", name, known)
        for name, each in known.items():
            if name not in values and each.default is MISSING:
                raise InputError(f"study.{name}", "must be given", None, f"A study of kind {cls.kind!r} needs it.")
        return cls(model, **values)

    @property
    def gears(self) -> Gears | None:
        """The gears on which the result depends besides the model: those of an axis ``speed`` or ``torque``."""
        varied = {axis.name for axis in self._axes()} & {q.name for q in OPERATION}
        return gears_of(self.model) if varied else None

    def provenance(self, **settings: Any) -> dict[str, Any]:
        """Attributes of the Dataset: study, model and its gears, the settings given here, and versions."""
        torque = [axis for axis in self._axes() if axis.name == "torque"]
        if torque:  # by which `physical` recognises a result from which the coordinate was dropped
            settings["torque_range"] = [torque[0].start, torque[0].stop]
        return provenance(self.kind, self.model, **settings) | versions_of(type(self))

    def _axes(self) -> list[Axis]:
        """All fields that are axes."""
        return [value for f in fields(self) if isinstance(value := getattr(self, f.name), Axis)]

    def __getstate__(self) -> dict[str, Any]:
        """The fields alone; cached properties are computed again from them."""
        return {f.name: getattr(self, f.name) for f in fields(self)}

    def _set(self, **values: Any) -> None:
        """Set fields of the frozen value in `__post_init__`."""
        for name, value in values.items():
            object.__setattr__(self, name, value)


@dataclass(frozen=True)
class ClassifyingStudy(Study):
    """A study that classifies motions, by its ``settings``; without any by the ``default_settings`` of its class."""

    default_settings: ClassVar[Classification] = Classification()

    settings: Classification | None = field(default=None, kw_only=True, metadata={
        "words": "Lengths of the runs by which motions are classified."})

    def __post_init__(self) -> None:
        super().__post_init__()
        self._set(settings=as_settings(self.settings) or self.default_settings.over(self.model.most_cycles))

    @property
    def classification(self) -> Classification:
        """The settings, which `__post_init__` has set where none were given."""
        return self.settings or self.default_settings

    def thinned(self, share: float) -> Self:
        """As of every study; one without axes has shorter runs, after which it is known whether its motion repeats."""
        if self.axes:
            return super().thinned(share)
        first = self.classification.transient_lengths[:1]
        return replace(self, settings=replace(self.classification, transient_lengths=first, doublings=0,
                                              longest_transient=0))

    def provenance(self, **settings: Any) -> dict[str, Any]:
        """As that of every study, with the classification settings."""
        return super().provenance(**settings, classification=asdict(self.classification))


class WholeStudy(Study):
    """A study of which the result is a single work item, a Dataset whose size nobody knows before it is computed.

    A store keeps it as the bytes of a NetCDF file until the run is finished.
    """

    run_options: ClassVar[tuple[Option, ...]] = ()

    @abstractmethod
    def dataset(self, *, progress: bool = False, threads: int | None = None) -> xr.Dataset:
        """The result."""

    def run(self, *, progress: bool = False, threads: int | None = None, **run_options: Any) -> xr.Dataset:
        threads = None if threads is None else whole_number("threads", threads, 1)
        announce(self, progress, threads)
        return self.dataset(progress=progress, threads=threads, **run_options)

    @property
    def grid(self) -> dict[str, int]:
        return {"result": 1}

    @cached_property
    def cost(self) -> Cost:
        """No bound of the time: how far a branch has to be followed, is not known beforehand."""
        return self.estimate(1, 0)

    def compute(self, items: np.ndarray, *, progress: bool = False, threads: int | None = None) -> Results:
        content = netcdf_bytes(self.dataset(progress=progress, threads=threads))
        return {"netcdf": np.frombuffer(content, np.uint8)[None]}

    def finish(self, found: Results, *, progress: bool = False, threads: int | None = None) -> xr.Dataset:
        if np.all(found["netcdf"] == np.iinfo(np.uint8).max):  # not computed, or lost
            return new_dataset({}, attrs=self.provenance())
        return from_netcdf_bytes(found["netcdf"][0].tobytes())
