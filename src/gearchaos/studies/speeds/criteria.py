"""What makes a motion one to avoid, and from which initial states motions are looked for."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from gearchaos.dynamics import Classification
from gearchaos.dynamics.settings import as_settings
from gearchaos.errors import InputError, whole_number
from gearchaos.gears.geometry.root_stress import ROOT_STRESS
from gearchaos.gears.io.units import STRESS, to_si
from gearchaos.quantities import POSITIVE, Rule
from gearchaos.studies.operation.load_change import REVERSAL, LoadChange, StateSampler, wide_states
from gearchaos.studies.operation.quasi_static import ratio_in_words
from gearchaos.studies.operation.severities import CRITERION, FORCE_CRITERION
from gearchaos.validation import check_rule, to_float

CRITERIA = ("", FORCE_CRITERION, CRITERION)  # in rising order of severity: what does not count, 1 and 2
STARTS = 128  # random initial states at each speed
SPACING = 0.0025  # largest distance of these speeds, as a share of the speed
_SPACINGS = Rule(lambda v: (v >= 1e-3) & (v <= 1), "must lie in [0.001, 1]")


@dataclass(frozen=True)
class Criteria:
    """What makes a motion one to avoid, and from which initial states motions are looked for."""

    factor: float | None = None
    root_stress: float | None = None
    separation: bool = True
    starts: int = STARTS
    spacing: float = SPACING
    seed: int = 0
    settings: Classification = field(default_factory=Classification)
    load_change: LoadChange | None = REVERSAL
    wide: bool = False
    knocks: bool = True

    @classmethod
    def checked(
        cls, starts: Any, spacing: Any, seed: Any, settings: Any, *, factor: Any = None, root_stress: Any = None,
        separation: bool = True, load_change: Any = REVERSAL.ratio, wide: bool = False, knocks: bool = True,
    ) -> Criteria:
        """The criteria; raises `InputError` for what is out of bounds."""
        if factor is not None:
            factor = to_float("factor", factor)
            check_rule("factor", factor, POSITIVE)
        if root_stress is not None:
            root_stress = to_si("root_stress", root_stress, STRESS, POSITIVE)
        if factor is None and root_stress is None and not separation:
            raise InputError("factor", "must be given with separation=False", None, "E.g. factor=1.5.")
        starts, seed = whole_number("starts", starts, 0), whole_number("seed", seed, 0)
        spacing = to_float("spacing", spacing)
        check_rule("spacing", spacing, _SPACINGS)
        change = None if load_change is None else LoadChange.checked(load_change)
        if starts == 0 and (wide or change not in (None, REVERSAL)):
            raise InputError("starts", "must be at least 1 for states after a load change, or wide ones", starts)
        return cls(factor, root_stress, separation, starts if change or wide else 0, spacing, seed,
                   as_settings(settings) or Classification(), change, wide, knocks)

    def words(self, ratio: float) -> str:
        """They as words, where the quasi-static ratio is this, or not known, NaN."""
        over = " over the quasi-static ratio" * bool(ratio_in_words(ratio))
        return ", or ".join(filter(None, [
            CRITERION * self.separation,
            "" if self.factor is None else f"the dynamic factor{over} exceeds {self.factor:g}",
            "" if self.root_stress is None else f"the nominal root stress exceeds {self.root_stress:g} "
            f"{ROOT_STRESS.unit}"]))

    @property
    def others(self) -> str:
        """The name of the motions that operation does not meet, see `MOTIONS`."""
        return "other" if self.wide else "load change"

    @property
    def change_in_words(self) -> str:
        """Beside operation, from where states come; empty for none."""
        if self.wide:
            return "any state of wide ranges is met" * (self.starts > 0)
        return self.load_change.words if self.load_change and self.starts else ""

    @property
    def draw(self) -> StateSampler:
        """Which random states are drawn."""
        return wide_states if self.wide else self.load_change or REVERSAL
