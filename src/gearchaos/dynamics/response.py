"""Tables of arrays over many motions, and the first of them: response measures, from integrals and extrema.

Each column is declared once, with its meaning, type, dimensions and the variable that it becomes in results.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields
from functools import cache
from typing import Annotated, Any, Literal, Self, get_args, get_type_hints

import numpy as np

from gearchaos.flow import Measure, of_meshes

MOTION = "motion"
"""Name of the dimension of the L motions."""

MESH = "mesh"
"""Name of the dimension of the K meshes of a train; there are none of a pair."""


@dataclass(frozen=True)
class Column:
    """Declaration of a column: its quantity with unit, the type of its array, the names of its dimensions.

    ``missing`` is the value of an element that is not computed, ``variable`` the name of the variable in results, None
    for a column that these do not contain; ``stored`` is the type of that variable where it differs from ``dtype``, and
    ``reduce`` makes its values (L,) where they are not the array itself. A response measure is also reported of each
    attractor of an operating point, unless ``of_attractors`` is False. ``mesh`` says of which mesh it is: of the
    first, of the one where it is worst, or of all together.
    """

    meaning: str
    dtype: type = float
    dims: tuple[str, ...] = (MOTION,)
    missing: Any = np.nan
    variable: str | None = None
    stored: type | None = None
    reduce: Callable[[np.ndarray], np.ndarray] | None = None
    of_attractors: bool = True
    mesh: Literal["first", "worst", "all"] = "first"

    def empty(self, sizes: Mapping[str, int]) -> np.ndarray:
        """An array of missing values; ``sizes`` are those of the dimensions by name."""
        return np.full([sizes[dim] for dim in self.dims], self.missing, self.dtype)

    def index(self, motions: Any) -> tuple[Any, ...]:
        """Index of the array for a selection of motions, given as an index of the motion dimension."""
        return tuple(motions if dim == MOTION else slice(None) for dim in self.dims)


@dataclass
class Columns:
    """Base class of tables.

    Each field of a derived dataclass is a column, ``name: Annotated[np.ndarray, Column(...)]``, or another table of
    the same motions, ``name: Table``.
    """

    @classmethod
    @cache
    def _declarations(cls) -> dict[str, Column | type[Columns]]:
        """By field, the declaration of the column, or the class of the nested table."""
        hints = get_type_hints(cls, include_extras=True)
        return {f.name: (get_args(hints[f.name]) or (None, hints[f.name]))[1] for f in fields(cls)}

    @classmethod
    def declared(cls) -> dict[str, Column]:
        """The declarations of all columns by name, those of nested tables included."""
        out: dict[str, Column] = {}
        for name, declaration in cls._declarations().items():
            out |= {name: declaration} if isinstance(declaration, Column) else declaration.declared()
        return out

    @classmethod
    def empty(cls, sizes: Mapping[str, int]) -> Self:
        """A table of missing values; ``sizes`` are those of the dimensions by name."""
        return cls(**{name: declaration.empty(sizes) for name, declaration in cls._declarations().items()})

    def _arrays(self) -> Iterator[np.ndarray]:
        """The arrays of all columns, those of nested tables included, in the order of `declared`."""
        for name in self._declarations():
            value = getattr(self, name)
            yield from value._arrays() if isinstance(value, Columns) else (value,)

    def __getitem__(self, name: str) -> np.ndarray:
        """The column of this name in this table or a nested one; raises `KeyError` if there is none."""
        return dict(zip(self.declared(), self._arrays(), strict=True))[name]

    def take(self, motions: Any) -> Self:
        """A copy of the table for a selection of motions, given as an index of the motion dimension."""
        values = {}
        for name, declaration in self._declarations().items():
            value = getattr(self, name)
            if isinstance(declaration, Column):
                values[name] = value[declaration.index(motions)].copy()
            else:
                values[name] = value.take(motions)
        return type(self)(**values)

    def put(self, motions: Any, other: Self) -> None:
        """Overwrite a selection of motions with those of another table, which has as many motions as are selected."""
        for column, own, new in zip(self.declared().values(), self._arrays(), other._arrays(), strict=True):
            own[column.index(motions)] = new

    def variables(self, *, double: bool = False) -> dict[str, np.ndarray]:
        """The variables (L,) of results, by name and with the types that results store.

        With ``double`` the variables stored in single precision are returned in double precision.
        """
        out: dict[str, np.ndarray] = {}
        for column, array in zip(self.declared().values(), self._arrays(), strict=True):
            if column.variable is not None and array.size:
                values = array if column.reduce is None else column.reduce(array)
                dtype = column.stored or column.dtype
                out[column.variable] = values.astype(float if double and dtype is np.float32 else dtype, copy=False)
        return out


CONTACTS = ("permanent", "one-sided", "two-sided", "none")
"""Contact states of a motion: never lost; lost, but the back flank not reached; both flanks reached; no contact."""


@dataclass
class Response(Columns):
    """Response measures of L motions, each (L,), dimensionless as in (2.10)-(2.12).

    Averages and extrema are over one period of an orbit, or `Classification.averaging_periods` for other motions.
    If a new measure needs an integral or extremum that `flow.Measure` does not have, it becomes a row there first. Then
    the measure is declared here, computed in `compute_response`, and described by a row in `quantities/tables.py`.
    """

    v_rms: Annotated[np.ndarray, Column(
        "root mean square of x1' (of z' in the single model), the paper's quality index", variable="v_rms")]
    contact_fraction: Annotated[np.ndarray, Column(
        "share of the time with |z| > 1", variable="contact_fraction", mesh="worst")]
    contact: Annotated[np.ndarray, Column(
        "index into `CONTACTS`", np.int8, missing=CONTACTS.index("none"), variable="contact",
        mesh="worst")]
    dynamic_factor: Annotated[np.ndarray, Column(
        "peak of |mesh force| over the static mesh force; NaN without static load", variable="dynamic_factor",
        mesh="worst")]
    z_rms: Annotated[np.ndarray, Column(
        "root mean square of z about its mean", variable="z_rms", stored=np.float32, of_attractors=False)]
    z_peak_to_peak: Annotated[np.ndarray, Column(
        "range of z", variable="z_peak_to_peak", stored=np.float32, of_attractors=False)]
    z_dot_rms: Annotated[np.ndarray, Column(
        "root mean square of z'", variable="z_dot_rms", stored=np.float32, of_attractors=False)]
    z_dot_peak_to_peak: Annotated[np.ndarray, Column(
        "range of z'", variable="z_dot_peak_to_peak", stored=np.float32, of_attractors=False)]
    switches_per_period: Annotated[np.ndarray, Column(
        "contact switches per mesh period", variable="switches", stored=np.float32, of_attractors=False, mesh="all")]
    mesh_force_peak: Annotated[np.ndarray, Column(
        "peak of |mesh force|, with or without static load", mesh="worst")]


_OF_MESH = (MOTION, MESH)


@dataclass
class MeshResponse(Columns):
    """Response measures of the K meshes of a train in L motions, each (L, K), over the same time as those of
    `Response`."""

    mesh_contact: Annotated[np.ndarray, Column(
        "index into `CONTACTS`", np.int8, dims=_OF_MESH, missing=CONTACTS.index("none"), variable="mesh_contact")]
    mesh_front_share: Annotated[np.ndarray, Column(
        "share of the time on the front flank", dims=_OF_MESH, variable="mesh_front_share")]
    mesh_back_share: Annotated[np.ndarray, Column(
        "share of the time on the back flank", dims=_OF_MESH, variable="mesh_back_share")]
    mesh_peak_force: Annotated[np.ndarray, Column("peak of |mesh force|", dims=_OF_MESH, variable="mesh_peak_force")]
    mesh_rms_force: Annotated[np.ndarray, Column(
        "root mean square of the mesh force", dims=_OF_MESH, variable="mesh_rms_force")]
    mesh_mean_force: Annotated[np.ndarray, Column("mean of the mesh force, negative on the back flank", dims=_OF_MESH)]
    mesh_least_force: Annotated[np.ndarray, Column(
        "least |mesh force|, 0 where contact is lost or the flank changes", dims=_OF_MESH)]
    mesh_force_deviation: Annotated[np.ndarray, Column(
        "standard deviation of the mesh force", dims=_OF_MESH, variable="mesh_force_deviation")]
    mesh_impacts: Annotated[np.ndarray, Column(
        "closings of the contact per unit of τ", dims=_OF_MESH, variable="mesh_impacts")]
    mesh_impulse: Annotated[np.ndarray, Column(
        "impulse of all contacts per unit of τ: mean of the force that presses the flanks together", dims=_OF_MESH,
        variable="mesh_impulse")]
    mesh_dynamic_factor: Annotated[np.ndarray, Column(
        "peak of |mesh force| over the static mesh force; NaN without static load", dims=_OF_MESH,
        variable="mesh_dynamic_factor")]


@dataclass
class Deflections(Columns):
    """Extrema of the deflection of the teeth of the first mesh in L motions, each (L,), in half backlashes, over the
    same time as those of `Response`."""

    compression: Annotated[np.ndarray, Column("least one on the front flank, 0 or less where the teeth separate")]
    deflection: Annotated[np.ndarray, Column("largest one on either flank")]

    @classmethod
    def of(cls, measures: np.ndarray) -> Deflections:
        """Those of measures (K len(Measure), L) in the rows of `flow.Measure`."""
        low, high = measures[Measure.Z_MIN], measures[Measure.Z_MAX]
        return cls(low - 1, np.maximum(high, -low) - 1)


def compute_response(
    measures: np.ndarray, duration: np.ndarray, periods: np.ndarray, static_force: np.ndarray
) -> tuple[Response, MeshResponse]:
    """Response measures of L motions, and of each of K meshes, from integrals and extrema (K len(Measure), L) in the
    rows of `flow.Measure`.

    ``duration`` (L,) in units of τ is also given in mesh ``periods`` (L,); ``static_force`` (L, K) are the mesh forces
    of the static load.
    """
    m, time = np.moveaxis(of_meshes(measures), 0, 2), duration[:, None]  # (len(Measure), L, K)
    front, back = m[Measure.FRONT_TIME], m[Measure.BACK_TIME]
    share = np.clip((front + back) / time, 0.0, 1.0)
    kept = (share > 1 - 1e-12) | ((share > 0.5) & (m[Measure.SWITCHES] == 0))  # times of many segments have rounding
    contact = np.select([(front > 0) & (back > 0), kept, share > 0], [2, 0, 1], default=3).astype(np.int8)
    low, high = m[Measure.FORCE_MIN], m[Measure.FORCE_MAX]
    peak = np.maximum(np.abs(high), np.abs(low))
    mean, square = m[Measure.FORCE] / time, m[Measure.FORCE_SQUARE] / time
    factor = peak / np.where(static_force == 0, np.nan, np.abs(static_force))
    meshes = MeshResponse(
        mesh_contact=contact, mesh_front_share=front / time, mesh_back_share=back / time, mesh_peak_force=peak,
        mesh_rms_force=np.sqrt(square), mesh_mean_force=mean,
        mesh_least_force=np.where(low * high > 0, np.minimum(np.abs(high), np.abs(low)), 0.0),
        mesh_force_deviation=np.sqrt(np.maximum(square - mean**2, 0.0)),
        mesh_impacts=m[Measure.SWITCHES] / 2 / time, mesh_impulse=m[Measure.CONTACT_FORCE] / time,
        mesh_dynamic_factor=factor)
    first = m[:, :, 0]
    unused = (contact == 3) & (static_force == 0) & static_force.any(axis=1, keepdims=True)  # e.g. a stop that is open
    offset = first[Measure.Z] / duration  # of the mean of z from the reference
    return Response(
        v_rms=np.sqrt(first[Measure.VELOCITY_SQUARE] / duration),
        contact_fraction=share.min(axis=1),
        contact=np.where(unused, 0, contact).max(axis=1),
        dynamic_factor=np.fmax.reduce(factor, axis=1),
        z_rms=np.sqrt(np.maximum(first[Measure.Z_SQUARE] / duration - offset**2, 0.0)),
        z_peak_to_peak=first[Measure.Z_MAX] - first[Measure.Z_MIN],
        z_dot_rms=np.sqrt(first[Measure.Z_DOT_SQUARE] / duration),
        z_dot_peak_to_peak=first[Measure.Z_DOT_MAX] - first[Measure.Z_DOT_MIN],
        switches_per_period=m[Measure.SWITCHES].sum(axis=1) / periods,
        mesh_force_peak=peak.max(axis=1),
    ), meshes
