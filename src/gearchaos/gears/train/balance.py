"""The mean torque of a train as a whole: what is left over, and the speeds at which it balances."""

from __future__ import annotations

from typing import Any

import numpy as np

from gearchaos.gears.train.structure import RANK, Train, as_given, structure


def mean_imbalance(train: Train) -> tuple[float, float, str]:
    """The mean torque that is left over where the train turns as a whole, N m at a body, the sum of the magnitudes of
    all, and that body: the last one with a torque, or the last one."""
    found = structure(train)
    for mode, (left,), (size,) in zip(found.rigid.T, *(each.T for each in found.imbalance(as_given)), strict=True):
        moved = [body for body in found.free if abs(mode[found.index[body.name, "angle"]]) > RANK]
        if abs(left) > 0 and moved:
            body = [each for each in moved if train.torque_of(each)][-1]
            share = abs(mode[found.index[body.name, "angle"]])
            sign = np.sign(mode[found.index[body.name, "angle"]]) * found.sense(body.name)
            return float(sign * left / share), float(size / share), body.name
    return 0.0, 1.0, ""


def balancing_speeds(train: Train) -> list[float]:
    """The speeds of the first body, rpm, at which the mean torques balance where some depend on the speed: the roots of
    what is left over, which is linear between the speeds of the tables."""
    found, tables = structure(train), [np.array(body.torque_over_speed.speed) / abs(float(train.ratios[body.name]))
                                       for body in train.bodies if body.torque_over_speed and train.ratios[body.name]]
    if not tables:
        return []
    low, high = max(each[0] for each in tables), min(each[-1] for each in tables)
    knots = np.unique(np.clip(np.concatenate(tables), low, high))

    def torque(name: str, _: str, own: Any) -> Any:
        body = train.body(name)
        return np.full(len(knots), own) if body.torque_over_speed is None else train.torque_at(body, knots)

    left, _ = found.imbalance(torque)  # (knots, motions)
    start, stop = left[:-1, 0], left[1:, 0]
    crossed = (start * stop <= 0) & (start != stop)
    roots = (knots[:-1] + np.diff(knots) * start / np.where(crossed, start - stop, 1.0))[crossed]
    return [speed for speed in np.unique(roots).tolist() if all(
        abs(np.interp(speed, knots, each)) <= 1e-9 * np.abs(each).max(initial=1e-300) for each in left.T)]
