"""Mesh stiffness of alternating single and double tooth contact, (2.16)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gearchaos.model.stiffness.base import Stiffness
from gearchaos.quantities import Quantity, Range, Rule
from gearchaos.validation import check_rule, to_float

_STIFF_PART = Rule(lambda v: v > -1, "must be greater than -1", "The mesh stiffness 1 + chi1 must stay positive.")
_SOFT_PART = Rule(lambda v: v < 1, "must be less than 1", "The mesh stiffness 1 - chi2 must stay positive.")
CONTACT_RATIO = Rule(
    lambda v: (v >= 1) & (v <= 2), "must lie in [1, 2]",
    "One or two tooth pairs share the load, (2.16). A ToothPairStiffness has up to four.")
_TABLE = "[model.stiffness]"
_STEP = Quantity("chi0", "χ₀", r"\chi_0", title="stiffness step", range=Range(-0.5, 0.75, -0.95, 0.95),
                 members=("chi1", "chi2"), toml_table=_TABLE)


@dataclass(frozen=True)
class TwoLevelStiffness(Stiffness):
    """Mesh stiffness of alternating single and double tooth contact, (2.16), over the reference stiffness c0.

    χ(τ) is 1 + χ1 for the part (α − 1)T of the mesh period, then 1 − χ2. Its time mean is
    1 + (α − 1) χ1 − (2 − α) χ2, which is 1 only where (α − 1) χ1 = (2 − α) χ2.

    Attributes
    ----------
    chi1, chi2 : float
        χ1 > −1 and χ2 < 1.
    contact_ratio : float
        α, from 1 to 2.

    Raises
    ------
    InputError
        If a value breaks its rule.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(stiffness=gc.TwoLevelStiffness(chi1=0.2, chi2=0.3, contact_ratio=1.6))
    >>> model.stiffness.chi2
    0.3
    """

    chi1: float = 0.25
    chi2: float = 0.25
    contact_ratio: float = 1.5

    kind = form = "two-level"
    noun, predicate = "a two-level stiffness, (2.16)", "has two levels"
    keys = "chi1, chi2 (or chi0) and contact_ratio"
    equation = "(2.16)"
    rows = (
        _STEP,
        replace(_STEP, name="chi1", symbol="χ₁", tex=r"\chi_{1}", members=(), rule=_STIFF_PART),
        replace(_STEP, name="chi2", symbol="χ₂", tex=r"\chi_{2}", members=(), rule=_SOFT_PART),
        Quantity("contact_ratio", "α", r"\alpha", title="contact ratio", range=Range(1.0, 2.0, 1.0, 4.0),
                 toml_table=_TABLE),  # each kind of stiffness has a rule of its own
    )
    level_names = ("chi1", "chi2")
    part_marks = (("$T_1$", r"$1+\chi_1$"), ("$T_2$", r"$1-\chi_2$"))
    pair_fields = {n: n for n in ("chi1", "chi2", "contact_ratio")}  # noqa: RUF012 -- no field, and never changed

    def __post_init__(self) -> None:
        for f in self.fields():
            object.__setattr__(self, f.name, to_float(f.name, getattr(self, f.name)))
        self.check_together({f.name: getattr(self, f.name) for f in self.fields()}, np.zeros((0, 1)), np.zeros((0, 1)))

    @classmethod
    def check_together(cls, values: Mapping[str, Any], amplitudes: np.ndarray, phases: np.ndarray) -> None:
        check_rule("contact_ratio", values["contact_ratio"], CONTACT_RATIO)

    @classmethod
    def parts(cls, values: Mapping[str, Any]) -> tuple[tuple[Any, Any], ...]:
        return (0, 1 + values["chi1"]), (values["contact_ratio"] - 1, 1 - values["chi2"])

    @property
    def outline(self) -> str:
        return "two levels"

    def describe(self) -> str:
        if self.chi1 == self.chi2 == 0:
            return "constant"
        return f"two levels, {1 + self.chi1:.4g} and {1 - self.chi2:.4g}, contact ratio {self.contact_ratio:.4g}"
