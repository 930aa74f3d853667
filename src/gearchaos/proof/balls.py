"""Ball arithmetic: its precision, and exact numbers as text, fractions and balls.

A ball [m ± r] of python-flint (Arb) stands for all numbers at most r from m. Every operation returns a ball that
contains all exact results for operands in the given balls. A comparison is true only if it holds for all numbers of the
balls, so that ``not (a > b)`` does not mean ``a <= b``.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from contextlib import contextmanager
from fractions import Fraction

try:
    from flint import arb, arb_mat, ctx, fmpq
except ModuleNotFoundError as error:
    if error.name != "flint":
        raise
    raise ModuleNotFoundError(
        'proofs need python-flint, which is not installed. Run: pip install "gearchaos[proof]"',
        name="flint",
    ) from None

LEAST_BITS, MOST_BITS = 53, 800  # precisions, in bits, that a proof accepts
_HEXADECIMAL = re.compile(r"(-?)0x([0-9a-f]+)(?:\.([0-9a-f]+))?p([+-]?[0-9]+)")
_DECIMAL = re.compile(r"-?[0-9]+(\.[0-9]+)?(e[+-]?[0-9]+)?")
_LARGEST_EXPONENT = 20_000


@contextmanager
def precision(bits: int) -> Iterator[None]:
    """Set the precision of ball arithmetic in bits; on leaving, restore what it was.

    It is global to the process, and python-flint is not safe in threads: parallel proofs need processes.
    """
    before = ctx.prec
    ctx.prec = bits
    try:
        yield
    finally:
        ctx.prec = before


def from_text(text: str) -> Fraction:
    """The number that a hexadecimal or decimal string means, exactly.

    Raises `ValueError` if the string has neither form, or an exponent of more than 20000.
    """
    if match := _HEXADECIMAL.fullmatch(text):
        sign, whole, part, exponent = match[1], match[2], match[3] or "", int(match[4])
        if abs(exponent) <= _LARGEST_EXPONENT:
            value = Fraction(int(whole + part, 16)) * Fraction(2) ** (exponent - 4 * len(part))
            return -value if sign else value
    elif (match := _DECIMAL.fullmatch(text)) and abs(int((match[2] or "e0")[1:])) <= _LARGEST_EXPONENT:
        return Fraction(text)
    raise ValueError(f"not a number in hexadecimal or decimal form: {text[:80]!r}")


def to_text(value: Fraction) -> str:
    """A hexadecimal string that means the dyadic number ``value`` exactly, such as ``0x1.8p-3``.

    Raises `ValueError` if the denominator is no power of 2.
    """
    numerator, denominator = abs(value.numerator), value.denominator
    if denominator & (denominator - 1):
        raise ValueError(f"{value} is not dyadic")
    if numerator == 0:
        return "0x0p+0"
    length = numerator.bit_length() - 1
    padding = -length % 4
    digits = f"{numerator << padding:x}"
    part = digits[1:].rstrip("0")
    exponent = length - (denominator.bit_length() - 1)
    return f"{'-' if value < 0 else ''}0x{digits[0]}{'.' + part if part else ''}p{exponent:+d}"


def texts(points: list[list[Fraction]]) -> list[list[str]]:
    """Points of dyadic coordinates as hexadecimal strings."""
    return [[to_text(value) for value in point] for point in points]


def fractions(points: list[list[str]]) -> list[list[Fraction]]:
    """Points as exact fractions from strings, see `from_text`."""
    return [[from_text(text) for text in point] for point in points]


def ball(value: Fraction | float | int) -> arb:
    """A ball that contains an exact number."""
    if isinstance(value, Fraction):
        return arb(fmpq(value.numerator, value.denominator))
    return arb(value)


def to_fraction(value: arb) -> Fraction:
    """The midpoint of a ball, exactly."""
    mantissa, exponent = value.mid().man_exp()
    return Fraction(int(mantissa)) * Fraction(2) ** int(exponent)


def rounded(value: arb, binary_digits: int) -> Fraction:
    """The midpoint of a ball, rounded to a multiple of 2^-``binary_digits``."""
    return Fraction(round(to_fraction(value) * 2**binary_digits), 2**binary_digits)


def interval(low: arb | float, high: arb | float) -> arb:
    """The smallest ball that contains two balls, and hence everything between."""
    return arb(low).union(arb(high))


def magnitude(value: arb) -> float:
    """A float that no absolute value of a number in the ball exceeds; infinite if the ball is not finite."""
    bound = float(value.abs_upper())
    return math.nextafter(bound, math.inf) if bound == bound else math.inf


def least(value: arb) -> float:
    """A float that no number in the ball is below; minus infinity if the ball is not finite."""
    bound = float(value.lower())
    return math.nextafter(bound, -math.inf) if bound == bound else -math.inf


def block(matrix: arb_mat, rows: int, columns: range) -> arb_mat:
    """The first rows and some consecutive columns of a matrix."""
    return arb_mat(rows, len(columns), [matrix[i, j] for i in range(rows) for j in columns])


def from_columns(columns: list[list[arb]]) -> arb_mat:
    """The matrix with these columns."""
    return arb_mat([list(row) for row in zip(*columns, strict=True)])


def unit(size: int) -> arb_mat:
    """The unit matrix."""
    return arb_mat(size, size, [int(i == j) for i in range(size) for j in range(size)])


def with_one(matrix: arb_mat) -> arb_mat:
    """A matrix (d, d) that acts on (w, 1) too, with the 1 left as it is: (d + 1, d + 1)."""
    return arb_mat([[*row, arb(0)] for row in matrix.tolist()] + [[arb(0)] * matrix.nrows() + [arb(1)]])


def norm(matrix: arb_mat) -> float:
    """A float that the largest row sum of absolute values does not exceed."""
    return max(math.fsum(map(magnitude, row)) for row in matrix.tolist()) * (1 + 2.0**-50)
