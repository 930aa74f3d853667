"""The period that all excitations of a train have in common, exactly or nearly."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping
from fractions import Fraction

from gearchaos.errors import InputError

MOST_CYCLES = 2000
"""Most cycles of the fastest excitation in the common period."""

LARGEST_TOLERANCE = 0.05
"""Largest relative deviation of orders that can be asked for."""

NEAR = 1e-3
"""Largest relative deviation of orders whose exact common period is too long, if none is asked for. It is small beside
the deviations of speeds and of natural frequencies from those computed."""


def common(orders: Iterable[Fraction]) -> Fraction:
    """The greatest common divisor of fractions."""
    found = list(orders)
    return Fraction(math.gcd(*(each.numerator for each in found)), math.lcm(*(each.denominator for each in found)))


def followed_orders(
    orders: Mapping[str, Fraction], tied: Iterable[Collection[Fraction]], tolerance: float
) -> dict[Fraction, Fraction]:
    """The orders that are followed in place of exact ones, so that all repeats soon: each exact order with its own.

    ``orders`` are exact ones by what they are of. Those that are ``tied``, as a mesh and the turns of its wheels, stay
    in their ratio. Orders stay exact with the ``tolerance`` 0, unless their common period is too long. Otherwise they
    are the multiples of the largest common order whose relative deviations are within the tolerance.

    Raises `InputError` where no common period is short enough.
    """
    exact, fastest = common(orders.values()), max(orders.values())
    if not tolerance and fastest / exact <= MOST_CYCLES:
        return {order: order for order in orders.values()}
    groups = [{order} for order in set(orders.values())]
    for together in map(set, tied):
        groups = [group for group in groups if not group & together] + [
            together.union(*(group for group in groups if group & together))]
    quanta = [common(group) for group in groups]
    largest = max(quanta)
    best, period = math.inf, largest
    for n in range(1, math.floor(MOST_CYCLES * largest / fastest) + 1):
        parts = [float(quantum * n / largest) for quantum in quanta]
        worst = max(abs(max(round(part), 1) / part - 1) for part in parts)
        if worst < best:
            best, period = worst, largest / n
        if best <= (tolerance or NEAR):
            break
    else:
        listed = ", ".join(f"{order} of {name}" for name, order in orders.items())
        raise InputError("common period", f"must have at most {MOST_CYCLES} cycles of the fastest excitation",
                         math.ceil(fastest / exact), (
                             f"Give frequency_tolerance = {best * 1.01:.2g}, by which orders may deviate." if
                             best < LARGEST_TOLERANCE else "Leave out what repeats with the turn of a wheel.") +
                         " Or choose numbers of teeth with common factors, and orders in simple ratios. "
                         f"Periods in a turn of the first body: {listed}.")
    return {order: order / quantum * max(round(quantum / period), 1) * period
            for group, quantum in zip(groups, quanta, strict=True) for order in group}
