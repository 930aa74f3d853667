"""Designs with one input changed, each assessed again: which assumption matters most, and which change helps most."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from typing import Any, NamedTuple

from gearchaos.errors import InputError
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.stiffness import methods
from gearchaos.gears.transmission_error.harmonics import FROM_QUALITY
from gearchaos.studies.speeds.assess import Assessment, assess

_LEAST = 1e-3  # share of the speeds by which what is usable must differ to be told apart
_SHARES = "usable_share", "usable_share_in_operation"
_DAMPING = (0.6, 1.6)  # factors of the damping ratio: its usual range about its middle
_BACKLASH = (0.7, 1.3)
_RELIEF = (0.0, 0.7, 1.3)  # factors of the tip relief
_NEW_RELIEF = (1.0, 2.0)  # amounts of a relief where there is none, over the deflection of the mesh under the load
_SHIFTS = (-0.1, 0.1)  # of the profile shift of wheel 1, in modules; that of wheel 2 changes by as much the other way
_ADDENDA = (-0.1, 0.1)  # of the addendum of the basic rack, in modules


@dataclass(frozen=True)
class Changed:
    """A design with one input changed, and its assessment; the reason says why there is none.

    ``name`` is that of the input, ``given`` its value and ``value`` the other one, in words.
    """

    name: str
    given: str
    value: str
    assessment: Assessment | None = None
    reason: str = ""

    def widening(self, found: Assessment) -> float:
        """By how much the usable share of the speeds is larger than in the assessment of the design itself: that after
        a load change too, or where this is the same that in operation."""
        own = self.assessment
        if own is None:
            return 0.0
        return own.usable_share - found.usable_share or own.usable_share_in_operation - found.usable_share_in_operation

    def told_apart(self, found: Assessment) -> bool:
        """Whether a usable share of it differs by more than the search leaves open, in both assessments."""
        own = self.assessment
        return own is not None and any(
            getattr(one, share) > getattr(other.sure, share) + _LEAST
            for one, other in ((own, found), (found, own)) for share in _SHARES)

    def document(self, found: Assessment) -> dict[str, Any]:
        """It ready for JSON, beside the assessment of the design itself."""
        own = self.assessment
        shares = {name: [getattr(found, name), None if own is None else getattr(own, name)]
                  for name in _SHARES}
        return {"input": self.name, "given": self.given, "value": self.value, "reason": self.reason, **shares,
                "told_apart": self.told_apart(found),
                "largest_margin": [_widest(found), None if own is None else _widest(own)]}


def _widest(found: Assessment) -> list[float]:
    """The edges of the range with the largest margin, rpm; none where nothing is usable at all torques."""
    return [edge for part in found.usable_at_all[:1] for edge in (part.start, part.stop)]


class Change(NamedTuple):
    """A change of an input: its name, its value and the other one in words, and the fields of the other design."""

    name: str
    given: str
    value: str
    fields: dict[str, Any]


def assumptions(design: GearDesign) -> Iterator[Change]:
    """The changes of what is assumed: damping ratio, grade, bound or typical error, method of the
    stiffness, load sharing and backlash."""
    zeta = design.damping_ratio or 0.0
    for factor in _DAMPING if zeta else ():
        yield Change("damping ratio", f"{zeta:g}", f"{zeta * factor:g}", {"damping_ratio": zeta * factor})
    quality, error = design.quality, design.transmission_error
    if quality is not None and isinstance(error, str) and error in FROM_QUALITY:
        same = {name: value for name, value in asdict(quality).items() if value is not None}
        for step in (-1, 1):
            grades = tuple(grade + step for grade in quality.grades)
            yield Change("accuracy grade", _both(quality.grades), _both(grades), {"quality": {**same, "grade": grades}})
        for other in FROM_QUALITY:
            if other != error and quality.deviations is None:
                yield Change("transmission error", error, other, {"transmission_error": other})
    given = design.stiffness if isinstance(design.stiffness, str) else "from a table"
    for method in methods():
        if method != given:
            yield Change("mesh stiffness", given, method, {"stiffness": method})
    for sharing, corners in ((None, True), (None, False), ("prescribed", None)):
        with suppress(InputError):  # for teeth that cannot have it, and one spring beside a relief
            fields: dict[str, Any] = {"load_sharing": sharing, "corner_contact": corners}
            changed = replace(design, **fields)
            if changed.sharing_in_words != design.sharing_in_words:
                yield Change("load sharing", design.sharing_in_words, changed.sharing_in_words, fields)
    yield from _backlash(design)


def improvements(design: GearDesign) -> Iterator[Change]:
    """The changes that a designer can make where the centre distance is fixed: relief, backlash, shift, addendum."""
    relief = design.tip_relief
    if relief is not None and any(relief.amount):
        for factor in _RELIEF:
            amount = tuple(factor * each for each in relief.amount)
            yield Change("tip relief", _in_um(relief.amount), _in_um(amount), {
                "tip_relief": replace(relief, amount=amount) if any(amount) else None})
    elif not design.helix_angle:
        deflection = design.torque / (design.geometry.base_diameter[0] / 2) / design.mesh_stiffness.reference
        shared = "" if design.shares_load else ", tooth pairs sharing the load"
        for factor in _NEW_RELIEF:
            yield Change("tip relief", "none", f"{_in_um([factor * deflection])} from the beginning of "
                         f"{design.geometry.least_contact}{shared}",
                         {"load_sharing": None, "tip_relief": {
                             "amount": factor * deflection,
                             "start_diameter": list(design.geometry.single_contact_diameter)}})
    yield from _backlash(design)
    x1, x2 = design.geometry.profile_shift
    for step in _SHIFTS:
        yield Change("profile shift", f"{x1:.4g}/{x2:.4g}", f"{x1 + step:.4g}/{x2 - step:.4g}", {
            "profile_shift": (x1 + step, x2 - step)})
    for step in _ADDENDA:
        addendum = design.rack.addendum + step
        yield Change("addendum in modules", f"{design.rack.addendum:g}", f"{addendum:.4g}", {
            "rack": replace(design.rack, addendum=addendum)})


def _backlash(design: GearDesign) -> Iterator[Change]:
    own = design.backlash_line_of_action
    for factor in _BACKLASH:
        yield Change("backlash", f"{1e3 * own:.4g} mm", f"{1e3 * own * factor:.4g} mm", {
            "backlash": {"value": factor * own, "of": "line of action, total"}})


def assess_changes(
    design: GearDesign, changes: Sequence[Change], speed: Any, torque: Any, **options: Any
) -> Iterator[Changed]:
    """Assess a design with each change, as `assess`; why one cannot be is its reason."""
    for name, given, value, fields in changes:
        try:
            yield Changed(name, given, value, assess(replace(design, **fields), speed, torque, **options))
        except InputError as error:
            yield Changed(name, given, value, reason=str(error))


def _in_um(lengths: Sequence[float]) -> str:
    return f"{_both([1e6 * each for each in lengths])} µm"


def _both(values: Sequence[float]) -> str:
    """The values of both wheels, or one if they are the same."""
    return "/".join(dict.fromkeys(f"{v:.4g}" for v in values))
