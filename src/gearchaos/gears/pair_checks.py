"""The rules for the values of a gear pair together, and warnings about unusual ones."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from gearchaos.errors import InputError
from gearchaos.gears import units

if TYPE_CHECKING:
    from gearchaos.gears.pair import GearPair

_STIFFNESS_FIELDS = (
    ("chi1", "chi2", "contact_ratio"), ("stiffness_amplitudes", "stiffness_phases"),
    ("stiffness_levels", "stiffness_starts"),
)
"""The fields of each kind of mesh stiffness."""

_RATIO_TOLERANCE = 0.01
"""Largest relative difference between the ratio of base radii and that of numbers of teeth."""


_MOST_DAMPING, _MOST_BACKLASH, _MOST_VELOCITY, _MOST_ERROR = 0.3, 5e-3, 300.0, 10.0
"""Damping ratio, backlash in m, velocity of the base circles in m/s, and an amplitude of the error over the backlash,
above which there is a warning."""


def pair_warnings(pair: GearPair) -> tuple[str, ...]:
    """Sentences about values that are possible but that slips of units may explain."""
    damping, velocity = pair.k / (2 * pair.mass * pair.omega0), pair.speed * units.RPM * pair.R1
    errors = max(map(abs, pair.error_amplitudes), default=0.0)
    phases = max((abs(phase) / j for series in (pair.error_phases, pair.stiffness_phases) for j, phase in enumerate(
        series, 1) if not isinstance(phase, units.Measured)), default=0.0)  # in angles of the first harmonic
    found = {
        f"The damping ratio k/(2 m ω0) is {damping:.3g}, unusually high: usual are 0.03 to 0.1. Check k, c0 and I1.":
            damping > _MOST_DAMPING,
        f"The backlash is {pair.backlash * 1e3:.4g} mm, unusually large: a plain number is in m.":
            pair.backlash > _MOST_BACKLASH,
        f"error_amplitudes has {errors * 1e6:.4g} µm, {errors / pair.backlash:.4g} times the backlash: a plain number "
        "is in m.": errors > _MOST_ERROR * pair.backlash,
        f"A phase is {phases:.6g} rad of the first harmonic, more than a turn: a plain number is in rad.":
            phases > 2 * math.pi,
        f"The base circles move at {velocity:.4g} m/s at {pair.speed:.6g} rpm, unusually fast. A plain one is in rpm.":
            velocity > _MOST_VELOCITY,
        f"chi1 is {pair.chi1}: the greater stiffness is more than twice c0. It is a fraction of c0, not a percentage.":
            (pair.chi1 or 0.0) > 1,
    }
    return tuple(text for text, holds in found.items() if holds)


def check_ratio(pair: GearPair) -> None:
    """Raise `InputError` unless the base radii have the ratio of the numbers of teeth, within `_RATIO_TOLERANCE`."""
    teeth, radii = pair.n1 / pair.n2, pair.R1 / pair.R2
    if abs(radii / teeth - 1) > _RATIO_TOLERANCE:
        raise InputError(
            "R1/R2", f"must equal n1/n2 = {teeth:.6g} to 1 %", round(radii, 6),
            f"With R1 = {units.Length(pair.R1, pair.R1)} and these teeth R2 would be "
            f"{units.Length(pair.R1 / teeth, pair.R1)}. "
            "R1 and R2 are base radii, m n cos(α)/2.",
        )


def check_supports(pair: GearPair) -> None:
    """Raise `InputError` unless the supports are elastic with all their values given, or rigid with none given."""
    missing = [name for name in ("c1", "c2", "m1", "m2") if getattr(pair, name) is None]
    if missing and not pair.rigid:
        raise InputError(
            missing[0], "must be given where the supports are elastic", None,
            "Give c1, c2, m1 and m2, or leave c1 and c2 out for rigid supports.",
        )
    for name in ("m1", "m2", "k1", "k2"):
        if pair.rigid and (value := getattr(pair, name)):
            rule = "must be left out where the supports are rigid"
            raise InputError(name, rule, value, "It has no effect there. Or give c1, c2, m1 and m2.")


def check_waveforms(pair: GearPair) -> None:
    """Raise `InputError` if the stiffness is given in two ways, or a series has more phases than amplitudes."""
    kinds = [[n for n in names if getattr(pair, n) not in (None, (), [])] for names in _STIFFNESS_FIELDS]
    (first, *_), *others = [names for names in kinds if names] or [["none"]]
    for names in others:
        raise InputError(first, f"must be left out beside {names[0]}", getattr(pair, first),
                         "The mesh stiffness has two levels (2.16), or is a series (2.7), or has steps.")
    if len(pair.stiffness_starts) and not len(pair.stiffness_levels):
        raise InputError("stiffness_starts", "must be left out without stiffness_levels", pair.stiffness_starts,
                         "They are where the steps of the mesh stiffness begin.")
    for kind in ("error", "stiffness"):
        amplitudes, phases = getattr(pair, f"{kind}_amplitudes"), getattr(pair, f"{kind}_phases")
        if len(phases) > len(amplitudes):
            raise InputError(
                f"{kind}_phases", f"must not be longer than {kind}_amplitudes ({len(amplitudes)})", len(phases),
                "Give one phase per harmonic; missing ones are 0.",
            )
