"""Rattle of loose and lightly loaded wheels of a train: where contact is lost, impacts, and which drag stops it."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from gearchaos.datasets import describe, new_dataset, variable
from gearchaos.dynamics import Classification
from gearchaos.dynamics.response import CONTACTS, MESH, MeshResponse
from gearchaos.errors import InputError, unknown_name
from gearchaos.execute.tiles import interleaved
from gearchaos.flow import WIDTH
from gearchaos.model import vary
from gearchaos.model.contacts import MeshContacts
from gearchaos.model.switched import switched_system
from gearchaos.studies.core.axis import Axis
from gearchaos.studies.core.cost import Cost
from gearchaos.studies.core.declaration import function_of
from gearchaos.studies.core.initial_value_problems import initial_value_problems
from gearchaos.studies.core.options import axis_option, option
from gearchaos.studies.core.study import ClassifyingStudy, WholeStudy, mesh_coordinate
from gearchaos.studies.maps.bifurcation import BIFURCATION_SETTINGS, Bifurcation
from gearchaos.studies.motion.batch_classification import classify_batch

if TYPE_CHECKING:
    import xarray as xr

HISTORIES = {"rest": "fixed", "rising": "up", "falling": "down"}
"""How a motion is reached: from rest, or by a slow sweep of the axis; and the mode of `Bifurcation`."""

_PERMANENT = CONTACTS.index("permanent")
_PARTS, _ROUNDS = WIDTH + 1, 9  # of the search of an onset: parts of the interval, whose inner ends are one pack
_INSTANTS = 4096  # of a period at which a linear force of several orders is looked at


@dataclass(frozen=True)
class Rattle(ClassifyingStudy, WholeStudy):
    """Scan a train for rattle: where its meshes lose contact, their impacts, and the drag that stops them.

    Returns
    -------
    xarray.Dataset
        Over ``history`` (from rest, and after slow sweeps of the axis, rising and falling), the axis and ``mesh``:
        ``mesh_contact``, ``mesh_front_share``, ``mesh_back_share``, ``mesh_impacts``, ``mesh_impulse``,
        ``mesh_peak_force``, ``mesh_rms_force`` and ``mesh_force_deviation``, its standard deviation; ``label`` and
        ``period`` of the motion. Over the axis and ``mesh`` ``excitation_ratio``, the largest fall of the linear
        deflection below its mean over that mean: contact is lost where it exceeds 1. Over ``onset`` the values of the
        axis at which the contact of a mesh from rest changes, ``onset_value``, with ``onset_mesh``, and
        ``onset_linear``, where the linear deflection vanishes; NaN if the stiffness of a mesh varies.

    Raises
    ------
    InputError
        If the model is no train, or the axis or a name is wrong.

    Notes
    -----
    Without play and with constant stiffness a train is linear. For one wheel under one order, with m = J/r_b², the
    fall of its spring force is r_b m r_a α k/|k − m w² + i c w| over the drag torque. At low speed it is the ratio of
    inertia to drag by which the literature judges rattle: contact is lost where J α r_a/r_b exceeds the drag
    (R. Singh, H. Xie, R. J. Comparin, *Analysis of automotive neutral gear rattle*, J. Sound Vib. 131 (1989) 177).

    Examples
    --------
    >>> import gearchaos as gc
    >>> driver = gc.Body(name="driver", motion=[{"order": 2, "acceleration": "300 rad/s^2"}])
    >>> loose = gc.Body(name="loose", inertia="5e-4 kg*m^2", torque="-0.2 N*m")
    >>> mesh = gc.Mesh(between=("driver", "loose"), teeth=(20, 30), base_radii=("30 mm", "45 mm"),
    ...                stiffness="2e8 N/m", damping="60 N*s/m", backlash="0.12 mm")
    >>> train = gc.Train(speed="800 rpm", bodies=[driver, loose], meshes=[mesh])
    >>> found = gc.rattle(train, "loose.torque=-0.2:-0.05:4")
    >>> found.onset_value.values.round(6).tolist(), found.onset_linear.values.round(6).tolist()
    ([-0.100003], [-0.100003])

    As a value
    ----------
    >>> import gearchaos as gc
    >>> driver = gc.Body(name="driver", motion=[{"order": 2, "acceleration": "300 rad/s^2"}])
    >>> loose = gc.Body(name="loose", inertia="5e-4 kg*m^2", torque="-0.2 N*m")
    >>> mesh = gc.Mesh(between=("driver", "loose"), teeth=(20, 30), base_radii=("30 mm", "45 mm"),
    ...                stiffness="2e8 N/m", damping="60 N*s/m", backlash="0.12 mm")
    >>> train = gc.Train(speed="800 rpm", bodies=[driver, loose], meshes=[mesh])
    >>> study = gc.Rattle(train, "loose.torque=-0.2:-0.12:2")
    >>> study.kind, study.count
    ('rattle', 1)
    """

    kind: ClassVar[str] = "rattle"
    rank: ClassVar[int] = 4
    group: ClassVar[str] = "Motions"
    summary: ClassVar[str] = "rattle"
    model_words: ClassVar[str] = "It must be a train."
    default_settings: ClassVar[Classification] = BIFURCATION_SETTINGS
    trial_of: ClassVar[Cost | None] = None  # the bound of the whole, of a part tried for its price
    rounds: ClassVar[int] = _ROUNDS  # of the search of onsets

    axis: Axis = axis_option('A speed or a drag torque and its range, as a text "loose.torque=-0.4:-0.02:39".')
    mesh: str | None = option(None, "The mesh whose onset is looked for; by default all.")

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.model.mesh_names:
            raise InputError("model", "must be a train", f"a {self.model.kind} model",
                             "Rattle is that of wheels under the orders of an engine: describe them in [train].")
        if self.mesh is not None and self.mesh not in self.model.mesh_names:
            raise unknown_name("mesh", self.mesh, self.model.mesh_names)
        if self.axis.name in self.model.state_names:
            raise InputError("axis", "must be a parameter", self.axis.name, "E.g. speed=600:3000:60.")
        vary(self.model, {self.axis.name: self.axis.values})  # raises for a value that the train refuses
        _ = self.cost

    @cached_property
    def cost(self) -> Cost:
        """That of three scans along the axis, two of them slow sweeps."""
        one = self._scan("up").cost
        return replace(one, motions=3 * one.motions, sequential=2 * one.sequential)

    def thinned(self, share: float) -> Self:
        """As of every study, with one round of the search of onsets: how many there are does not depend on the
        number of values, and how long their motions take is not told by the scans. The least part has none."""
        found = super().thinned(share)
        found._set(trial_of=self.trial_of or self.cost, rounds=int(share > 0))
        return found

    def smaller(self, share: float) -> None:
        """Nothing: the search of onsets, which may take most of the time, has as many motions for fewer values."""

    def needed(self, found: Any) -> float:
        """All of the bound for the scans, and all rounds of the search of as many onsets as this part shows."""
        search, whole = found.attrs["search_over_scans"], self.trial_of or self.cost
        return (1.0 + _ROUNDS * search * self.cost.seconds() / whole.seconds()) / (1.0 + search)

    def _scan(self, mode: str) -> Bifurcation:
        return Bifurcation(self.model, self.axis, points=0, mode=mode, settings=self.settings)  # type: ignore[arg-type]

    def dataset(self, *, progress: bool = False, threads: int | None = None) -> xr.Dataset:
        begun = time.perf_counter()
        scans = [scan.finish(scan.compute(np.arange(scan.count), progress=progress, threads=threads))
                 for scan in map(self._scan, HISTORIES.values())]
        scanned = time.perf_counter()
        over = ("history", self.axis.name, MESH)
        names = ["label", "period", *(name for name in MeshResponse.declared() if name in scans[0])]
        data = {n: np.stack([scan[n].values for scan in scans]) for n in names}
        found = {n: variable(n, over[: v.ndim], v) for n, v in data.items()}
        ratio = self._excitation(self.axis.values)
        found["excitation_ratio"] = variable("excitation_ratio", over[1:], ratio)
        permanent = data["mesh_contact"][0] == _PERMANENT
        onsets = self._onsets(permanent, progress=progress, threads=threads)
        trial = {"search_over_scans": (time.perf_counter() - scanned) / (scanned - begun)} if self.trial_of else {}
        columns = zip(*onsets, strict=True) if onsets else ((), (), ())
        axis = self.axis.name
        for name, values in zip(("onset_value", "onset_linear", "onset_mesh"), columns, strict=True):
            found[name] = variable(name, ("onset",), np.array(values, str if name == "onset_mesh" else float))
            if name != "onset_mesh":
                found[name].attrs |= {"quantity": axis, "units": describe(axis)["units"]}
        coords = {"history": variable("history", ("history",), np.array(list(HISTORIES))),
                  axis: variable(axis, (axis,), self.axis.values)}
        return new_dataset(found, coords | mesh_coordinate(self.model), self.provenance(mesh=self.mesh) | trial)

    def _changes(self, permanent: np.ndarray) -> list[tuple[int, int]]:
        """Where meshes begin or cease to keep contact between two values of the axis: the indices of mesh and value."""
        return [(m, i) for m, name in enumerate(self.model.mesh_names) if self.mesh in (None, name)
                for i in np.flatnonzero(permanent[1:, m] != permanent[:-1, m]).tolist()]

    def _onsets(self, permanent: np.ndarray, *, progress: bool, threads: int | None) -> list[tuple[float, float, str]]:
        """Value, linear value and mesh of each change between two values of the axis, from (count, K)."""
        values, changes = self.axis.values, self._changes(permanent)
        if not changes:
            return []
        meshes, at = np.array(changes).T
        low, high, first = values[at], values[at + 1], permanent[at, meshes][:, None]
        for _ in range(self.rounds):  # all onsets together
            edges = np.linspace(low, high, _PARTS + 1, axis=1)
            kept = self._keeps_contact(edges[:, 1:-1].ravel(), progress, threads)
            inner = kept.reshape(len(at), _PARTS - 1, -1)[np.arange(len(at)), :, meshes]
            k = np.argmax(np.diff(np.hstack([first, inner, ~first]).astype(int), axis=1) != 0, axis=1)
            low, high = (edges[np.arange(len(at)), k + side] for side in (0, 1))
        return [(float(real), self._linear_onset(m, i), self.model.mesh_names[m])
                for real, (m, i) in zip((low + high) / 2, changes, strict=True)]

    def _keeps_contact(self, values: np.ndarray, progress: bool, threads: int | None) -> np.ndarray:
        """Whether each mesh keeps contact in the motion from rest, (V, K), at values (V,) of the axis."""
        return classify_batch(
            lambda numbers: initial_value_problems(self.model, {self.axis.name: values[numbers]}),
            lambda _, motions, found: {"kept": found.meshes.mesh_contact == _PERMANENT},
            interleaved(len(values), threads), settings=self.classification,
            progress="onsets" if progress else None, threads=threads)["kept"]

    def _linear_onset(self, mesh: int, near: int) -> float:
        """The value nearest to that with an index at which the linear deflection of a mesh begins to vanish, or NaN."""
        values, below = self.axis.values, self._excitation(self.axis.values)[:, mesh] < 1
        vanishes = np.flatnonzero(below[1:] != below[:-1])
        i = int(vanishes[np.argmin(np.abs(values[vanishes] - values[near]))]) if len(vanishes) else near
        return _first_change(lambda v: self._excitation(v)[:, mesh] < 1, values[i], values[i + 1])

    def _excitation(self, values: np.ndarray) -> np.ndarray:
        """The largest fall of the linear deflection of each mesh below its mean, over that, at values (V,), (V, K)."""
        system = switched_system(vary(self.model, {self.axis.name: values}))
        contacts: MeshContacts = system.contacts  # type: ignore[assignment]
        if np.ptp(contacts.stiffness, axis=2).any() or np.ptp(contacts.offset, axis=2).any():
            return np.full((len(values), len(contacts.rows)), np.nan)
        front = [int(np.flatnonzero((contacts.meshes == m) & (contacts.sides > 0))[0])
                 for m in range(len(contacts.rows))]
        k, d = contacts.stiffness[:, front, 0], contacts.damping
        added = np.where(contacts.in_contact, d, 0.0)  # the damping of the others is in A
        force = k[..., None] * contacts.rows + added[..., None] * contacts.rates
        A = system.A - np.einsum("pki,pkj->pij", contacts.pushes, force)
        instants = np.arange(_INSTANTS) / _INSTANTS
        total = np.zeros((len(values), len(contacts.rows), _INSTANTS))
        for j, order in enumerate(contacts.orders.tolist()):
            amplitude = contacts.f_cos[:, j] - 1j * contacts.f_sin[:, j]
            eye = np.eye(A.shape[1])
            w = np.linalg.solve(1j * order * system.omega[:, None, None] * eye - A, amplitude[..., None])[..., 0]
            spring = k * np.einsum("ki,pi->pk", contacts.rows, w)
            if len(contacts.orders) == 1:
                total[..., 0] = -np.abs(spring)
                continue
            total += (spring[..., None] * np.exp(2j * np.pi * order * instants)).real
        return -total.min(axis=2) / np.where(system.static_force == 0, np.nan, np.abs(system.static_force))


rattle = function_of(Rattle)


def _first_change(holds: Any, low: float, high: float) -> float:
    """Where a condition of values (V,) first changes between two values, to 1e-8 of their distance; NaN if it does
    not."""
    for _ in range(_ROUNDS):
        values = np.linspace(low, high, _PARTS + 1)
        changes = np.flatnonzero(np.diff(holds(values).astype(int)))
        if not len(changes):
            return float("nan")
        low, high = values[changes[0]], values[changes[0] + 1]
    return float((low + high) / 2)
