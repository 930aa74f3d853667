"""The verdict on one motion, with the quantities that it is based on."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.datasets import new_dataset, provenance, variable
from gearchaos.display import HasCard
from gearchaos.dynamics import REASONS, Classification, Label, Reason, Verdicts, motion_name
from gearchaos.dynamics.response import CONTACTS, Response
from gearchaos.model import MeshModel

if TYPE_CHECKING:
    import xarray as xr

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
        """Kind of motion as its code."""
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
        return {name: pairs[name] if name in pairs else getattr(self, name) for name in names}

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
        scalars = {n: values[0] for n, values in v.variables(double=True).items()}
        scalars |= {n: v[n][0] for n, column in Response.declared().items() if column.variable is None}
        spectrum = {
            "lyapunov_spectrum": v.exponent[:, 0], "lyapunov_spectrum_lo": v.exponent_low[:, 0],
            "lyapunov_spectrum_hi": v.exponent_high[:, 0], "multipliers_real": v.multipliers[0].real,
            "multipliers_imag": v.multipliers[0].imag,
        }
        data = {n: variable(n, (), value) for n, value in scalars.items()}
        data |= {n: variable(n, ("exponent",), values) for n, values in spectrum.items()}
        data |= {f"section_{n}": variable(f"section_{n}", ("point",), np.array(x)) for n, x in self.section.items()}
        classes = {"motion": self.label, "spectral_label": self.spectral_label or "none"}
        attributes = provenance("regime", self.model, classification=asdict(self.settings))
        return new_dataset(data, attrs={**attributes, **classes})
