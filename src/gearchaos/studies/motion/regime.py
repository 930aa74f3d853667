"""The kind of motion at one operating point: its study, the verdict with its evidence, the steady motion in time."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from gearchaos.datasets import new_dataset, provenance, variable
from gearchaos.display import HasCard
from gearchaos.dynamics import REASONS, Classification, Label, Reason, Verdicts, classify, motion_name
from gearchaos.dynamics.response import CONTACTS, MESH, MeshResponse, Response
from gearchaos.dynamics.settings import SINGLE_MOTION
from gearchaos.dynamics.time_series import spectral_class
from gearchaos.dynamics.verdicts import label_and_period
from gearchaos.errors import InputError
from gearchaos.gears.io.units import measured
from gearchaos.gears.operation.operating import AnyModel, as_model
from gearchaos.model import MeshModel, vary
from gearchaos.model.base import SAMPLES
from gearchaos.model.coordinates import reset_mean_rotation, rotation_drifts, transmission_error_at_start
from gearchaos.model.switched import coordinates
from gearchaos.studies.core.cost import Cost
from gearchaos.studies.core.declaration import function_of
from gearchaos.studies.core.initial_value_problems import initial_value_problems
from gearchaos.studies.core.options import Option
from gearchaos.studies.core.price import announce
from gearchaos.studies.core.study import PROGRESS, ClassifyingStudy, Results, mesh_coordinate
from gearchaos.studies.motion.simulate import simulate, steady_sections

if TYPE_CHECKING:
    import xarray as xr

_SECTION_POINTS = 512
"""Number of stroboscopic points reported for a motion without a period."""

_MOST_SWINGS, _MOST_SAMPLES = 16, 1 << 16
"""Most periods of the natural vibration in a mesh cycle that are recorded with as many instants as one cycle has, and
most instants in a period."""

_ORBIT_PERIODS = 8
"""Number of periods of a periodic motion that are recorded."""

_OTHER_PERIODS = 512
"""Number of mesh periods of another motion that are recorded."""

_JSON_ORDER = (
    "label", "period", "reason", "multipliers", "lyapunov", "lyapunov_ci", "v_rms", "contact_fraction", "contact",
    "dynamic_factor", "section", "residual", "trace_error", "periods_spent", "switches_per_period", "z_rms",
    "z_peak_to_peak", "z_dot_rms", "z_dot_peak_to_peak", "spectral_label",
)
"""Order of the keys of `Verdict.to_dict`; response measures that are not listed follow."""


@dataclass(frozen=True, eq=False, repr=False)
class Verdict(HasCard):
    """The verdict on one motion; `regime` returns it.

    The response measures of `Response`, such as ``v_rms``, are attributes too: floats, or None where they do not exist.

    Parameters
    ----------
    model : MeshModel
        The operating point, with its initial values.
    verdicts : Verdicts
        Table with this one motion.
    section : dict of str to list of float
        Stroboscopic points of the steady motion, by coordinate: n points for a motion of period n, 512 for any other
        bounded motion, and empty for a motion that diverged.
    spectral_label : str or None
        The class that the spectrum of z and z' at those points suggests; see `spectral_class`.
    settings : Classification
        The settings by which the motion was classified.

    Notes
    -----
    How a verdict is reached is described in "Verdicts", in the manual's explanations.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.206)
    >>> verdict = gc.regime(model)
    >>> verdict.label, verdict.contact
    ('8T', 'two-sided')
    >>> [round(abs(m), 3) for m in verdict.multipliers]
    [0.509, 0.096]
    """

    model: MeshModel
    verdicts: Verdicts
    section: dict[str, list[float]]
    spectral_label: str | None
    settings: Classification

    @property
    def label(self) -> str:
        """Kind of motion: "1T", "2T", ..., "quasi-periodic", "chaotic", "undecided" or "diverged"."""
        return motion_name(self._label, self.period or 0)

    @property
    def _label(self) -> Label:
        return Label(int(self.verdicts.label[0]))

    @property
    def period(self) -> int | None:
        """Minimal period in mesh periods, None where there is none."""
        return int(self.verdicts.period[0]) or None

    @property
    def reason(self) -> str:
        """The reason for the label, a sentence from `REASONS`."""
        return REASONS[Reason(int(self.verdicts.reason[0]))]

    @property
    def multipliers(self) -> list[complex]:
        """Floquet multipliers of the orbit, largest modulus first; empty without an orbit."""
        return self.verdicts.multipliers[0].tolist() if self.period else []

    @property
    def lyapunov(self) -> list[float]:
        """Lyapunov exponents of the dynamic state per unit of τ, largest first."""
        return self.verdicts.exponent[self._known, 0].tolist()

    @property
    def lyapunov_ci(self) -> list[list[float]]:
        """The interval [low, high] of each exponent: at 99 % confidence, or exact for an orbit."""
        low, high = self.verdicts.exponent_low[:, 0], self.verdicts.exponent_high[:, 0]
        return np.stack([low, high], axis=1)[self._known].tolist()

    @property
    def _known(self) -> np.ndarray:
        """Whether each exponent is computed, (d,) of bool."""
        return np.isfinite(self.verdicts.exponent[:, 0])

    @property
    def residual(self) -> float | None:
        """Largest change of a coordinate over one period of the orbit, None without an orbit."""
        return self._number("residual") if self.period else None

    @property
    def trace_error(self) -> float | None:
        """|sum of the exponents − trace of the linear part|, per unit of τ."""
        return self._number("trace_error")

    @property
    def periods_spent(self) -> int:
        """Mesh periods of the transient and exponent runs."""
        return int(self.verdicts.periods_run[0])

    @property
    def contact(self) -> str | None:
        """Contact state, one of `CONTACTS`; None if the motion diverged."""
        return None if self._label == Label.DIVERGED else CONTACTS[int(self.verdicts.response.contact[0])]

    @property
    def meshes(self) -> dict[str, dict[str, Any]]:
        """Of a train, by the name of the mesh: ``contact``, ``front_share`` and ``back_share`` of the time on each
        flank, ``force_peak``, ``force_rms``, ``force_mean`` and ``force_least`` in N, ``impacts_per_second``,
        ``impulse_per_second`` in N, and ``dynamic_factor``; None where a number does not exist. Empty for a pair."""
        model: Any = self.model
        if not model.mesh_names or self._label == Label.DIVERGED:
            return {}
        units, found = model.units, self.verdicts.meshes
        numbers = {"front_share": found.mesh_front_share, "back_share": found.mesh_back_share,
                   "force_peak": found.mesh_peak_force * units.force, "force_rms": found.mesh_rms_force * units.force,
                   "force_mean": found.mesh_mean_force * units.force,
                   "force_least": found.mesh_least_force * units.force,
                   "impacts_per_second": found.mesh_impacts * units.rate,
                   "impulse_per_second": found.mesh_impulse * units.force, "dynamic_factor": found.mesh_dynamic_factor}
        return {name: {"contact": CONTACTS[int(found.mesh_contact[0, m])], **{
            n: float(v[0, m]) if math.isfinite(v[0, m]) else None for n, v in numbers.items()}}
                for m, name in enumerate(model.mesh_names)}

    @property
    def load_shares(self) -> dict[str, dict[str, float]]:
        """Of a train, by the name of a body whose load several meshes share: of each mesh the mean torque that it
        transmits over that of all."""
        model: Any = self.model
        out, meshes = {}, self.meshes
        for body, radii in model.train.parallel_paths.items() if meshes else ():
            torques = {name: radius * (meshes[name]["force_mean"] or 0.0) for name, radius in radii.items()}
            if total := sum(torques.values()):
                out[body] = {name: torque / total for name, torque in torques.items()}
        return out

    def __getattr__(self, name: str) -> float | None:
        """A response measure by its name."""
        if name in Response.declared():
            return self._number(name)
        raise AttributeError(f"'Verdict' object has no attribute {name!r}")

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *Response.declared()]

    def _number(self, name: str) -> float | None:
        """The value of a column of the verdicts, None where it is not finite."""
        value = float(self.verdicts[name][0])
        return value if math.isfinite(value) else None

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Verdict) and self.to_dict() == other.to_dict()

    def __repr__(self) -> str:
        return f"Verdict({', '.join(f'{n}={v!r}' for n, v in self.to_dict().items() if n != 'section')})"

    def to_dict(self) -> dict[str, Any]:
        """All attributes as JSON-ready values, None where a number does not exist; multipliers as [re, im]."""
        names = dict.fromkeys((*_JSON_ORDER, *Response.declared()))
        pairs = {"multipliers": [[m.real, m.imag] for m in self.multipliers]}
        model: Any = self.model
        train = {"common_period": model.train.period, "meshes": self.meshes,
                 "load_shares": self.load_shares} if model.mesh_names else {}
        return {name: pairs[name] if name in pairs else getattr(self, name) for name in names} | train

    def to_dataset(self) -> xr.Dataset:
        """The verdict as labelled variables.

        Returns
        -------
        xarray.Dataset
            The variables that `zones` has for a cell, as scalars in double precision, and the response measures that
            `zones` omits; ``lyapunov_spectrum``, ``lyapunov_spectrum_lo``, ``lyapunov_spectrum_hi``,
            ``multipliers_real`` and ``multipliers_imag`` over the dim "exponent"; and ``section_<coordinate>`` over the
            dim "point". The attributes contain the model and its gears, the settings, the ``motion`` and the
            ``spectral_label``.
        """
        v = self.verdicts
        scalars = {n: values[0] for n, values in v.variables(double=True).items() if values.ndim == 1}
        meshes = {n: values[0] for n, values in v.variables(double=True).items() if values.ndim > 1}
        scalars |= {n: v[n][0] for n, column in Response.declared().items() if column.variable is None}
        spectrum = {
            "lyapunov_spectrum": v.exponent[:, 0], "lyapunov_spectrum_lo": v.exponent_low[:, 0],
            "lyapunov_spectrum_hi": v.exponent_high[:, 0], "multipliers_real": v.multipliers[0].real,
            "multipliers_imag": v.multipliers[0].imag,
        }
        data = {n: variable(n, (), value) for n, value in scalars.items()}
        data |= {n: variable(n, ("exponent",), values) for n, values in spectrum.items()}
        data |= {n: variable(n, (MESH,), values) for n, values in meshes.items()}
        data |= {f"section_{n}": variable(f"section_{n}", ("point",), np.array(x)) for n, x in self.section.items()}
        classes = {"motion": self.label, "spectral_label": self.spectral_label or "none"}
        attributes = provenance("regime", self.model, classification=asdict(self.settings))
        return new_dataset(data, mesh_coordinate(self.model), {**attributes, **classes})


def shared_loads(verdict: Verdict, unit: float = 1.0) -> list[tuple[str, ...]]:
    """How meshes share the load of a body, those alike in one row: the body and the mesh load factor Kγ of ISO 6336-1,
    the largest share over an even one, in its first row; the share, the mean, the least and the largest force over a
    ``unit`` in N, and the mesh."""
    out: list[tuple[str, ...]] = []
    for body, load in verdict.load_shares.items():
        alike: dict[tuple[str, ...], list[str]] = {}
        for name, share in load.items():
            forces = (measured(abs(verdict.meshes[name][f"force_{n}"]) / unit) for n in ("mean", "least", "peak"))
            alike.setdefault((f"{100 * share:.3g} %", *forces), []).append(name)
        first = body, f"{len(load) * max(load.values()):.3f}"
        for numbers, (name, *others) in alike.items():
            out.append((*first, *numbers, name + f" and {len(others)} alike" * bool(others)))
            first = "", ""
    return out


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
    trial_of: ClassVar[Classification | None] = None  # the settings of the whole, of a part tried for its price

    def __post_init__(self) -> None:
        super().__post_init__()
        _ = self.cost

    @cached_property
    def cost(self) -> Cost:
        return self.estimate(1, self.classification.max_periods)

    def thinned(self, share: float) -> Self:
        """As of every study without axes."""
        found = super().thinned(share)
        found._set(trial_of=self.trial_of or self.classification)
        return found

    def needed(self, found: xr.Dataset) -> float:
        """The share that a motion of the kind takes that this part shows. A period of an exponent run, which has d
        tangent vectors, takes as long as d + 1 others."""
        own, whole, motion = self.classification, self.trial_of or self.classification, found.attrs["motion"]
        bound = own.max_periods / whole.max_periods
        runs = {"chaotic": 2, "quasi-periodic": 1, "undecided": 2 ** (whole.doublings + 1) - 1}
        if motion not in runs:  # as soon known as in this part
            return bound
        run = (self.cost.dimension + 1) * own.exponent_run
        before = whole.longest_transient if motion == "chaotic" else sum(whole.transient_lengths)
        return bound * (before + whole.averaging_periods + runs[motion] * run) / (
            sum(own.transient_lengths) + own.averaging_periods + run)

    def verdict(self) -> Verdict:
        """The verdict on the motion; see `regime`."""
        problem = initial_value_problems(self.model)
        verdicts = classify(problem.flow, problem.w, settings=self.classification)
        if verdicts.label[0] == Label.DIVERGED:
            return Verdict(self.model, verdicts, {}, None, self.classification)
        sections = steady_sections(problem, verdicts, _SECTION_POINTS)
        spectral_label, _ = spectral_class(np.stack([sections["z"][0], sections["z_dot"][0]], axis=1))
        count = int(verdicts.period[0]) or _SECTION_POINTS
        section = {name: x[0, -count:].tolist() for name, x in sections.items()}
        return Verdict(self.model, verdicts, section, spectral_label, self.classification)

    def result(self, **run_options: Any) -> Verdict:
        announce(self, **run_options)
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
            over = MESH if name in MeshResponse.declared() else "point" if name.startswith("section_") else "exponent"
            dims = () if values.ndim == 1 else (over,)
            if not name.startswith("spectral_"):
                data[name] = variable(name, dims, values[0])
        classes = {}
        for name, prefix in (("motion", ""), ("spectral_label", "spectral_")):
            label, period = (int(found[f"{prefix}{n}"][0]) for n in ("label", "period"))
            classes[name] = motion_name(Label(label), period) if label else "none"
        return new_dataset(data, mesh_coordinate(self.model), {**self.provenance(), **classes})


regime = function_of(Regime)


def steady(model: AnyModel, verdict: Verdict) -> xr.Dataset:
    """The steady motion that `regime` found, sampled in time.

    Parameters
    ----------
    model : MeshModel, GearPair or GearDesign
        The operating point.
    verdict : Verdict
        The verdict on this model, which contains the stroboscopic points of the motion.

    Returns
    -------
    xarray.Dataset
        As from `simulate`, starting at the last stroboscopic point of the verdict: eight periods of a periodic motion,
        512 mesh periods of any other; of a train fewer, where its period has many mesh cycles. A cycle has 64 samples,
        or as many for each period of the natural vibration if that is shorter, at most 1024; a period at most 65,536.

    Raises
    ------
    InputError
        If the motion diverged.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.206)
    >>> motion = gc.steady(model, gc.regime(model))
    >>> motion.sizes["period"]
    64
    """
    model = as_model(model)
    if not isinstance(verdict, Verdict):
        raise InputError("verdict", "must be a Verdict, as gearchaos.regime returns", f"a {type(verdict).__name__}")
    if not verdict.section:
        raise InputError("verdict", "must be of a motion that stays bounded", verdict.label)
    periods = max(1, _ORBIT_PERIODS // model.most_cycles) * verdict.period if verdict.period else max(
        1, _OTHER_PERIODS // model.most_cycles)
    swings = math.ceil(min(1 / (model.omega * model.most_cycles), _MOST_SWINGS))  # of the natural vibration in a cycle
    point: dict[str, float] = {name: values[-1] for name, values in verdict.section.items()}
    initial, batch = {name: point[name] for name in model.coordinate_names}, vary(model, {})
    names = coordinates(batch)
    if rotation_drifts(batch, names)[0]:
        # reset to the initial mean rotation of the model, since z loses digits as the difference of large x1 and x2
        if "y" in names:
            point |= {"y": point["y1"] - point["y2"], "y_dot": point["y1_dot"] - point["y2_dot"]}
        w = np.array([[point[n] for n in names]])
        kept = reset_mean_rotation(batch, names, w, *transmission_error_at_start(batch))
        initial |= {n: float(v[0]) for n, v in kept.items()}
    samples = min(SAMPLES * model.most_cycles * swings, _MOST_SAMPLES)
    return simulate(replace(model, initial=initial), periods, samples=samples)
