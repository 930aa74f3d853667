"""The decision over speed and torque: which speeds to avoid, which to use, and with what margin."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from gearchaos.dynamics import Classification
from gearchaos.errors import InputError
from gearchaos.gears.design.values import method_in_words
from gearchaos.gears.operation.operating import AnyModel, as_model, gears_of, is_design
from gearchaos.studies.core.axis import Axis
from gearchaos.studies.core.operating_ranges import range_of_speeds, torques_of
from gearchaos.studies.core.price import announce
from gearchaos.studies.operation.factor_context import peak_root_stress
from gearchaos.studies.operation.load_change import REVERSAL
from gearchaos.studies.speeds.criteria import SPACING, STARTS, Criteria
from gearchaos.studies.speeds.speed_and_torque import checked_operating_model, with_torque
from gearchaos.studies.speeds.speed_search import SpeedSearch
from gearchaos.studies.speeds.speed_windows import SpeedsToAvoid, UsableRange, Window
from gearchaos.studies.speeds.speeds_to_avoid import summarised

_EFFORTS = (
    (24.0, STARTS, SPACING, 10_000),
    (96.0, 64, 0.01, 10_000),
    (math.inf, 32, 0.025, 2000),
)
"""Up to how many torques times ln(last / first speed): random initial states, the spacing of their speeds, and the
periods after which a motion that still looks chaotic counts as such."""

_MOST_TOLD = 3


@dataclass(frozen=True, eq=False)
class Assessment:
    """What to avoid and what to use, over speed and torque.

    Attributes
    ----------
    gears : GearDesign, GearPair or Train
        What was assessed, at its first speed and torque.
    at : tuple of SpeedsToAvoid
        What was found at each torque, in rising order of torque.
    speeds : tuple of float
        The first and the last speed, rpm.
    like_teeth : bool
        Whether faults, pitch errors and eccentricity of a design were left out.
    """

    gears: Any
    at: tuple[SpeedsToAvoid, ...]
    speeds: tuple[float, float]
    like_teeth: bool = False

    @property
    def avoid(self) -> list[tuple[float, Window]]:
        """All ranges to avoid, each with its torque."""
        return [(each.torque, window) for each in self.at for window in each.windows]

    @property
    def usable(self) -> list[tuple[float, UsableRange]]:
        """All ranges between them, each with its torque, those with the largest margin first."""
        found = [(each.torque, part) for each in self.at for part in each.usable]
        return sorted(found, key=lambda pair: -pair[1].margin)

    @property
    def usable_at_all(self) -> list[UsableRange]:
        """The ranges of speed that are usable at all torques, those with the largest margin first."""
        return self._common([each.usable for each in self.at])

    @property
    def usable_in_operation(self) -> list[UsableRange]:
        """The same where the load is never lost nor reversed."""
        return self._common([each.usable_in_operation for each in self.at])

    def _common(self, usable: Sequence[Sequence[UsableRange]]) -> list[UsableRange]:
        common = [self.speeds]
        for parts in usable:
            common = [(max(a, part.start), min(b, part.stop)) for a, b in common for part in parts
                      if max(a, part.start) < min(b, part.stop)]
        return sorted((UsableRange(a, b) for a, b in common), key=lambda part: -part.margin)

    @property
    def usable_share(self) -> float:
        """The share of the speeds that is usable at all torques, also after a load change, from 0 to 1."""
        return self._share(self.usable_at_all)

    @property
    def usable_share_in_operation(self) -> float:
        """The same where the load is never lost nor reversed."""
        return self._share(self.usable_in_operation)

    def _share(self, parts: Sequence[UsableRange]) -> float:
        return sum(part.stop - part.start for part in parts) / (self.speeds[1] - self.speeds[0])

    @property
    def sure(self) -> Assessment:
        """It without what a search drawn anew may well not find to be avoided: what lies beyond the edges that are
        located, and ranges to which few load changes lead."""
        return replace(self, at=tuple(replace(each, windows=tuple(
            replace(w, start_resolution=0.0, stop_resolution=0.0) for w in each.windows if not w.may_be_missed))
            for each in self.at))

    @property
    def tried(self) -> str:
        """From which initial states motions were looked for, at all torques, of many at the first and the last."""
        if len(self.at) == 1:
            return self.at[0].tried
        told = self.at if len(self.at) <= _MOST_TOLD else (self.at[0], self.at[-1])
        return "; ".join(f"at {each.torque:.6g} N m {each.tried}" for each in told)

    @property
    def assumptions(self) -> list[str]:
        """What the answer rests on, and what it leaves out."""
        gears, first = self.gears, self.at[0]
        model = as_model(gears)
        out = [f"mesh damping {model.damping_in_words}", *model.assumptions]
        if is_design(gears):
            out = [f"mesh stiffness {method_in_words(gears.stiffness)}",
                   f"transmission error: {first.transmission_error}",
                   f"damping ratio {gears.damping_ratio:g} {gears.law.words}", *gears.assumptions]
            out.append(f"load sharing: {gears.sharing_in_words}")
        if self.like_teeth:
            out.append("all teeth are taken to be alike: faults, pitch errors and eccentricity are left out")
        out.append("friction is left out, and all that is not among the inputs")
        out += [f"at {each.torque:g} N m {each.coarse}" for each in self.at if each.coarse]
        out.append(f"beyond the teeth: {first.teeth_bear}")
        out.append(f"motions were looked for {self.tried}: one that few states lead to, in a narrow range, can "
                   "be missed")
        return out

    def document(self) -> dict[str, Any]:
        """All of it, ready for JSON; what is usable also after a load change only where these were looked at."""
        after = (True, False) if self.at[0].load_change else (False,)
        return {
            "speeds": list(self.speeds), "torques": [each.torque for each in self.at],
            "units": {"speed": "rpm", "torque": "N*m"},
            "criterion": self.at[0].criterion,
            "avoid": [{
                "torque": torque, "from": w.start, "to": w.stop, "cause": w.cause, "begins_with": w.begins_with,
                "ends_with": w.ends_with, "from_resolution": w.start_resolution, "to_resolution": w.stop_resolution,
                "dynamic_factor": w.dynamic_factor, "speed_of_largest": w.speed_of_largest,
                "root_stress": peak_root_stress(self.gears, torque, w.dynamic_factor),
                "largest_after_load_change": w.largest_after_load_change and asdict(w.largest_after_load_change),
                "depends_on_history": w.depends_on_history, "history": w.history and list(w.history),
                "reached_by": w.reached_by, "share_of_load_changes": w.share_of_load_changes,
                "severity": w.severity, "beyond_the_teeth": w.beyond_the_teeth,
                "random_states": None if w.random_states is None else asdict(w.random_states), "meshes": list(w.meshes),
                "motions": [each.motion for each in w.reached],
            } for torque, w in self.avoid],
            "knocks": [knock.document(each.torque) for each in self.at for knock in each.knocks],
            "usable": [{"torque": each.torque, **part.document, "after_load_change": changed} for each in self.at
                       for changed in after for part in (each.usable if changed else each.usable_in_operation)],
            "usable_share": self.usable_share, "usable_share_in_operation": self.usable_share_in_operation,
            "usable_at_all_torques": [part.document | {"after_load_change": changed} for changed in after
                                      for part in (self.usable_at_all if changed else self.usable_in_operation)],
            "jumps": [{"torque": each.torque, "speed": jump.speed, "direction": jump.direction, "event": jump.event,
                       "from": jump.factor_before, "to": jump.factor_after} for each in self.at for jump in each.jumps],
            "quasi_static_ratio": [each.quasi_static_ratio for each in self.at],
            "tried": [each.tried for each in self.at],
            "beyond_the_teeth": [each.teeth_bear for each in self.at], "assumptions": self.assumptions,
        }


def assess(
    gears: AnyModel, speed: Axis | str, torque: Any = None, *, factor: float | None = None,
    root_stress: float | str | None = None, starts: int | None = None, spacing: float | None = None, seed: int = 0,
    load_change: float | None = REVERSAL.ratio, wide: bool = False, knocks: bool = True,
    settings: Classification | None = None, progress: bool = False, threads: int | None = None,
) -> Assessment:
    """Assess gears over speed and torque: which speeds to avoid, which to use, and with what margin.

    As `speeds_to_avoid` at several torques side by side, and for trains too.

    Parameters
    ----------
    gears : GearDesign, GearPair or Train, or the model of one
    speed : Axis or str
        The range of speeds of wheel 1 in rpm: "500:6000", or with a number of first speeds "500:6000:120".
    torque : torques, optional
        At wheel 1, one or several: numbers in N m, texts such as "60 N*m", or a text "20:400:12" for twelve of them; by
        default that of the gears.
    factor, root_stress, starts, spacing, seed, load_change, wide, knocks, settings, progress, threads
        As in `speeds_to_avoid`; by default there are fewer and wider spaced random states at many torques.

    Returns
    -------
    Assessment

    Raises
    ------
    InputError
        If the gears are not known, a torque is given twice or has no effect, or as in `speeds_to_avoid`.

    Examples
    --------
    >>> import gearchaos as gc
    >>> design = gc.GearDesign(
    ...     teeth=(50, 50), module="3 mm", face_width="20 mm", bore="30 mm", damping_ratio=0.05,
    ...     backlash={"value": "0.12 mm", "of": "line of action, total"}, transmission_error="from quality (typical)",
    ...     quality={"standard": "ISO 1328-1:1995", "grade": 6})
    >>> found = gc.assess(design, "800:1200:10", [100, 300], starts=4)
    >>> [(torque, window.words, window.begins_with) for torque, window in found.avoid]
    [(100.0, '860 to 941 rpm', 'graze'), (100.0, '1057 to 1164 rpm', 'graze')]
    >>> [round(part.margin, 3) for part in found.usable_at_all]
    [0.059, 0.036, 0.015]
    """
    axis = range_of_speeds(speed)
    torques: list[float | None] = [None] if torque is None else sorted(torques_of(torque))  # type: ignore[assignment]
    for given in torques:
        _check_load(given)
    width = len(torques) * math.log(max(axis.stop / max(axis.start, 1e-3 * axis.stop), 1))
    number, spaced, longest = next(each[1:] for each in _EFFORTS if width <= each[0])
    like_teeth = is_design(gears) and gears.turning
    if is_design(gears):
        gears = with_torque(gears, torques[0])
    gears = gears.at(speed=axis.start) if is_design(gears) else gears
    base = checked_operating_model(as_model(gears)).with_values(
        {"speed": axis.start} | ({} if torques[0] is None else {"torque": torques[0]}))
    own = None if base.mesh_names else base.value("torque")
    _check_load(own)
    criteria = Criteria.checked(
        number if starts is None else starts, spaced if spacing is None else spacing, seed,
        settings or Classification(longest_transient=longest).over(base.most_cycles),
        factor=factor, root_stress=root_stress, load_change=load_change, wide=wide, knocks=knocks)
    search = SpeedSearch(base, axis, [own if t is None else t for t in torques], criteria)
    announce(search, progress, threads)
    found = search.run(progress=progress, threads=threads)
    return Assessment(gears_of(base), tuple(map(summarised, found)), (axis.start, axis.stop), like_teeth)


def _check_load(torque: float | None) -> None:
    """Raise `InputError` for a torque of 0."""
    if torque == 0:
        raise InputError("torque", "must be finite and not 0", torque,
                         "Without load there is no ratio of forces; gearchaos rattle looks at gears without load.")
