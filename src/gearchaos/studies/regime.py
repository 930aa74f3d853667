"""The kind of motion at one operating point."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from gearchaos.datasets import new_dataset, variable
from gearchaos.dynamics import Classification, Label, classify, motion_name
from gearchaos.dynamics.settings import SINGLE_MOTION
from gearchaos.dynamics.time_series import spectral_class
from gearchaos.dynamics.verdicts import label_and_period
from gearchaos.model import vary
from gearchaos.model.switched import switched_system
from gearchaos.studies.cost import Cost, estimate
from gearchaos.studies.declaration import function_of
from gearchaos.studies.initial_value_problems import initial_value_problems
from gearchaos.studies.options import Option
from gearchaos.studies.sections import steady_sections
from gearchaos.studies.study import PROGRESS, ClassifyingStudy, Results
from gearchaos.studies.verdict import Verdict

if TYPE_CHECKING:
    import xarray as xr

_SECTION_POINTS = 512
"""Number of stroboscopic points reported for a motion without a period."""


@dataclass(frozen=True)
class Regime(ClassifyingStudy):
    """Classify the motion at one operating point, with its evidence.

    Returns
    -------
    Verdict
        With the ``label``, the ``reason``, the ``multipliers`` of the orbit, all ``lyapunov`` exponents of the dynamic
        state with their intervals, the response measures, and the stroboscopic ``section``.

    Raises
    ------
    InputError
        If the model or the settings are of another type, or the motion cannot be computed in a reasonable time; before
        any work.

    Examples
    --------
    >>> import gearchaos as gc
    >>> verdict = gc.regime(gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.206))
    >>> verdict.label, verdict.reason
    ('8T', 'a stable periodic orbit converged and the trajectory approaches it')

    As a value
    ----------
    >>> import gearchaos as gc
    >>> study = gc.Regime(gc.MeshModel.of(q0=0.1, eps1=0.1))
    >>> study.kind, study.count
    ('regime', 1)
    """

    kind: ClassVar[str] = "regime"
    rank: ClassVar[int] = 2
    returns: ClassVar[str] = "Verdict"
    run_options: ClassVar[tuple[Option, ...]] = (PROGRESS,)
    default_settings: ClassVar[Classification] = SINGLE_MOTION

    def __post_init__(self) -> None:
        super().__post_init__()
        _ = self.cost

    @cached_property
    def cost(self) -> Cost:
        return estimate(switched_system(vary(self.model, {})), 1, self.classification.max_periods)

    def verdict(self) -> Verdict:
        """The verdict on the motion; see `regime`."""
        problem = initial_value_problems(self.model)
        verdicts = classify(problem.flow, problem.w, settings=self.classification)
        if verdicts.label[0] == Label.DIVERGED:
            return Verdict(self.model, verdicts, {}, None, self.classification)
        sections = steady_sections(problem, verdicts, _SECTION_POINTS)
        spectral_label, _ = spectral_class(np.stack([sections["z"][0], sections["z_dot"][0]], axis=1))
        count = int(verdicts.period[0]) or _SECTION_POINTS
        return Verdict(
            self.model, verdicts, {name: x[0, -count:].tolist() for name, x in sections.items()}, spectral_label,
            self.classification)

    def result(self, **run_options: Any) -> Verdict:
        self.cost.announce(**run_options)
        return self.verdict()

    def compute(self, items: np.ndarray, *, progress: bool = False, threads: int | None = None) -> Results:
        verdict = self.verdict()
        found = {name: values.values[None] for name, values in verdict.to_dataset().data_vars.items()}
        label, period = label_and_period(verdict.spectral_label) if verdict.spectral_label else (0, 0)
        spectral = {"spectral_label": np.array([label]), "spectral_period": np.array([period])}
        return {str(name): values for name, values in found.items()} | spectral

    def finish(self, found: Results, *, progress: bool = False, threads: int | None = None) -> xr.Dataset:
        data = {}
        for name, values in found.items():
            dims = () if values.ndim == 1 else ("point",) if name.startswith("section_") else ("exponent",)
            if not name.startswith("spectral_"):
                data[name] = variable(name, dims, values[0])
        classes = {"motion": _motion(found, ""), "spectral_label": _motion(found, "spectral_")}
        return new_dataset(data, attrs={**self.provenance(), **classes})


regime = function_of(Regime)


def _motion(found: dict[str, np.ndarray], prefix: str) -> str:
    """The name of a motion by its label and period among the results, "none" where there is no label."""
    label, period = (int(found[f"{prefix}{name}"][0]) for name in ("label", "period"))
    return motion_name(Label(label), period) if label else "none"
