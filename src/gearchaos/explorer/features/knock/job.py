"""What a knock does to the motion of a page: the least one that leads to a motion to avoid, and half of it."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace

import numpy as np

from gearchaos.dynamics import Classification, Label
from gearchaos.dynamics.response import CONTACTS
from gearchaos.errors import InputError
from gearchaos.explorer.features.motion.orbits import PeriodicMotion, periodic_motion
from gearchaos.explorer.features.motion.point import PointMotion
from gearchaos.gears.io.units import RPM
from gearchaos.gears.operation.operating import gears_of, pair_of
from gearchaos.model import vary
from gearchaos.model.switched import coordinates
from gearchaos.studies.core.initial_value_problems import initial_states
from gearchaos.studies.operation.beyond_the_teeth import TeethLimits
from gearchaos.studies.operation.followed_motions import FollowedMotions, Motion
from gearchaos.studies.operation.knocks import PHASES, Knock, Knocked, find_knocks, unit_step

BEFORE, AFTER, _SAMPLES = 4, 40, 48
"""Mesh periods that are shown before a knock and after it, and samples in each."""


@dataclass(frozen=True)
class KnockedMotion:
    """A motion after the least knock that leads to one to avoid and after half of it, or None if no knock up to the
    ``largest``, rpm of wheel 1, leads to one.

    ``time`` (S,) is in mesh periods from the knock, ``z`` (3, S) the displacement without a knock, after half of it,
    after the whole; ``half`` is what half of it leads to, ``back`` whether that is the motion before, and ``beyond``
    whether teeth cannot bear it.
    """

    knock: Knock | None
    largest: float
    time: np.ndarray
    z: np.ndarray
    half: Motion | None = None
    back: bool = False
    beyond: bool = False


def motion_to_knock(found: PointMotion) -> PeriodicMotion:
    """The motion at a point as one to knock; raises `InputError` if it is not periodic, has no load, or is to be
    avoided itself."""
    if not found.model.value("torque"):
        raise InputError("torque", "must not be 0", 0, "Without load no motion keeps contact.")
    if found.verdict.contact not in ("", CONTACTS[0]):
        raise InputError("motion", "must keep contact", found.verdict.contact,
                         "The teeth separate in this motion already: it is one to avoid without a knock.")
    try:
        return periodic_motion(found)
    except InputError:
        advice = "Only a periodic motion is knocked."
        raise InputError("motion", "must be periodic", found.verdict.label, advice) from None


def knocked_motion(motion: PeriodicMotion, dynamic_factor: float) -> Generator[KnockedMotion]:
    """What knocks do to a motion of a pair that keeps contact, as `gearchaos.assess` looks for them; the only result.
    """
    model, gears = motion.model, gears_of(motion.model)
    speed, torque = (float(model.value(name) or 0.0) for name in ("speed", "torque"))
    names = coordinates(vary(model, {}))
    on_orbit = replace(model, initial={}).with_values(dict(motion.state))
    (w,) = initial_states(on_orbit, {"speed": np.array([speed])}, names).T
    own = Motion(int(Label.PERIODIC), motion.period, 0, dynamic_factor, np.nan, (0.0, 0.0), w)
    motions, settings, limits = FollowedMotions(model), Classification(), TeethLimits.of(gears, torque)
    motions.speeds, motions.at = [speed], {speed: [own]}

    def criterion(each: Motion) -> int:
        return int(each.contact > 0 or beyond(each))

    def beyond(each: Motion) -> bool:
        return limits.exceeded(each.dynamic_factor, each.deflection)

    knocks, largest = find_knocks(motions, [speed], criterion, beyond, settings)
    if not knocks:
        yield KnockedMotion(None, largest, np.zeros(0), np.zeros((3, 0)))
        return
    knocked, (knock,) = Knocked(motions, [speed], criterion, settings), knocks
    step, phase = knock.speed_step * RPM / unit_step(pair_of(gears)), int(knock.phase * PHASES)
    (half,) = knocked.tried(np.zeros(1, int), np.array([phase]), np.array([step / 2])).reached
    after = knocked.sampled(0, phase, [0.0, step / 2, step], AFTER, _SAMPLES)
    first = -BEFORE % motion.period * _SAMPLES  # the orbit repeats
    before = np.repeat(after[first : first + BEFORE * _SAMPLES, :1], 3, axis=1)
    yield KnockedMotion(knock, largest, np.arange(-BEFORE * _SAMPLES, AFTER * _SAMPLES) / _SAMPLES,
                        np.concatenate([before, after]).T, half, half is own, half is not None and beyond(half))
