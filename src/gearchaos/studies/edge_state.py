"""The edge state between two attractors: the saddle whose stable manifold divides their basins."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import MISSING, dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from gearchaos.continuation.edge import EdgeState, track_edge
from gearchaos.continuation.family import ParameterFamily
from gearchaos.continuation.orbit import check_period, checked_state
from gearchaos.datasets import new_dataset, variable
from gearchaos.dynamics import Classification
from gearchaos.dynamics.settings import SINGLE_MOTION
from gearchaos.studies.declaration import function_of
from gearchaos.studies.options import option
from gearchaos.studies.study import ClassifyingStudy, WholeStudy

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class EdgeTracking(ClassifyingStudy, WholeStudy):
    """Find the saddle that divides the basins of two attractors, for any number of coordinates.

    Its stable manifold is the boundary between them.

    Returns
    -------
    EdgeState

    Raises
    ------
    InputError
        If both lead to the same attractor, or an argument is out of range.

    Notes
    -----
    Edge tracking: J. D. Skufca, J. A. Yorke, B. Eckhardt, Phys. Rev. Lett. 96, 174101, 2006. Attractors without a
    period are told apart by their kind of motion alone. A fractal boundary may contain several saddles: one of them is
    found, which depends on ``first`` and ``second``, and on their order.

    `gearchaos.run` of the study gives a Dataset: ``section_<coordinate>`` over "round", the states on the boundary in
    order of time, and the attribute ``orbit``, the saddle as JSON, null for none.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(kind="single", omega=0.7, q0=0.1, eps1=0.05)
    >>> found = gc.edge_state(model, {"z": 0.0, "z_dot": 0.0}, {"z": 1.5, "z_dot": 0.0})
    >>> found.orbit.period, found.orbit.unstable
    (1, 1)

    As a value
    ----------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(kind="single", omega=0.7, q0=0.1, eps1=0.05)
    >>> gc.EdgeTracking(model, {"z": 0.0, "z_dot": 0.0}, {"z": 1.5, "z_dot": 0.0}).rounds
    60
    """

    kind: ClassVar[str] = "edge_state"
    rank: ClassVar[int] = 11
    group: ClassVar[str] = "Bifurcations"
    needs_out: ClassVar[bool] = True
    returns: ClassVar[str] = "EdgeState"
    model_words: ClassVar[str] = "The operating point."
    default_settings: ClassVar[Classification] = SINGLE_MOTION

    first: Mapping[str, float] = option(MISSING, "Initial values that lead to one attractor.", keyword=False)
    second: Mapping[str, float] = option(MISSING, "Initial values that lead to another one.", keyword=False)
    period: int = option(4, "Largest period of the saddle, in mesh periods.")
    rounds: int = option(
        60, "Most times two neighbouring states are brought together again. They are on both sides of the boundary.",
        least=1, most=10_000)

    def __post_init__(self) -> None:
        super().__post_init__()
        check_period(self.period)
        for name in ("first", "second"):
            self._set(**{name: checked_state(self.model, getattr(self, name), name)})

    def result(self, **run_options: Any) -> EdgeState:
        family = ParameterFamily(self.model, ())
        starts = [ParameterFamily(self.model.with_values(state), ()) for state in (self.first, self.second)]
        first, second = (start.initial_states(start.start[None])[0] for start in starts)
        return track_edge(
            family, first, second, period=self.period, rounds=self.rounds, settings=self.classification)

    def dataset(self, *, progress: bool = False, threads: int | None = None) -> xr.Dataset:
        found = self.result()
        data = {f"section_{name}": variable(f"section_{name}", ("round",), x) for name, x in found.states.items()}
        attributes = self.provenance(
            first=dict(self.first), second=dict(self.second), period=self.period, rounds=self.rounds)
        orbit = json.dumps(None if found.orbit is None else found.orbit.to_dict())
        return new_dataset(data, attrs={**attributes, "orbit": orbit})


edge_state = function_of(EdgeTracking)
