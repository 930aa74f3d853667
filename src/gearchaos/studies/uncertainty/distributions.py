"""Distributions of uncertain inputs, as users write them, and samples of several inputs together."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gearchaos.errors import InputError, unknown_name
from gearchaos.validation import to_float

SCRAMBLES = 16
"""Independent scramblings of a Sobol sequence, from which intervals follow."""

WITHIN = "within the grade"
"""The distribution of the deviations of wheels, of which only the grade is known."""

_N = r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|[-+]?inf)"
_UNIT = r"([^\d\s.,:(±+-][^,:(±]*)?"
_RANGE = re.compile(rf"{_N}\s*{_UNIT}:\s*{_N}\s*{_UNIT}")
_SPREAD = re.compile(rf"{_N}\s*{_UNIT}(?:±|\+-|\+/-)\s*{_N}\s*{_UNIT}")
_NORMAL = re.compile(rf"normal\(\s*{_N}\s*,\s*{_N}\s*(?:,\s*{_N}\s*,\s*{_N}\s*)?\)\s*{_UNIT}")
_ITEM = re.compile(rf"{_N}\s*{_UNIT}")
_FORMS = ("E.g. backlash=0.10:0.25 mm, damping_ratio=0.05±0.01, 'damping_ratio=normal(0.05, 0.01, 0.02, 0.1)' with "
          "limits at the end, or quality.grade=6,7,8, with decimal points.")
_KEYS = ("name", "distribution", "mean", "sd", "low", "high", "values", "unit")
_TAKES = {"uniform": ("low", "high"), "normal": ("mean", "sd"), "list": ("values",),
          WITHIN: ()}  # keys that must be given
_EDGE = 1e-12  # how near to 0 and 1 probabilities are taken, where a normal distribution is infinite


@dataclass(frozen=True)
class Scattered:
    """An uncertain input in the unit in which it was given: a list of equal chances, normal with a mean, or uniform.

    A normal one may have limits, beyond which it is cut off; a uniform one lies between them.
    """

    name: str
    unit: str = ""
    low: float = -np.inf
    high: float = np.inf
    mean: float | None = None
    sd: float = 0.0
    items: tuple[Any, ...] = ()
    path: str = ""  # of the value of gears that it sets, if that is not the name

    @classmethod
    def parse(cls, text: Any) -> Scattered:
        """The input of a text ``name=…``; raises `InputError` for any other."""
        match = re.fullmatch(r"\s*([\w.]+)\s*=\s*(.*?)\s*", text) if isinstance(text, str) else None
        found = match and cls._of_words(match[1], match[2])
        if not found:
            raise InputError("vary", "must read name=low:high, name=mean±sd, name=normal(mean, sd) or name=x,y,z", text,
                             _FORMS)
        if len(found.items) == 0 and not found.low < found.high:
            raise InputError(found.name, "must have a lower limit below the upper one", text,
                             "A single value is no scatter: set it with --set, or in the file.")
        if found.mean is None and not np.isfinite(found.high - found.low) and not found.items:
            raise InputError(found.name, "must have finite limits", text)
        if found.mean is not None and not found.sd > 0:
            raise InputError(found.name, "must have a standard deviation greater than 0", text)
        if found.cut > 0.99:
            raise InputError(found.name, "must have limits that keep 1 % of its distribution or more", text)
        if len(set(found.items)) < len(found.items):
            raise InputError(found.name, "must have each value once", text)
        return found

    @classmethod
    def _of_words(cls, name: str, words: str) -> Scattered | None:
        if match := _NORMAL.fullmatch(words):
            mean, sd, low, high = (None if each is None else float(each) for each in match.groups()[:4])
            ends = (-np.inf, np.inf) if low is None or high is None else (low, high)
            return cls(name, (match[5] or "").strip(), *ends, mean=mean, sd=sd or 0.0)
        if (match := _RANGE.fullmatch(words) or _SPREAD.fullmatch(words)) is not None:
            first, own, second, unit = ((each or "").strip() for each in match.groups())
            if own and own != unit:
                raise InputError(name, "must have one unit", words, "Write it once, at the end.")
            numbers = float(first), float(second)
            if match.re is _RANGE:
                return cls(name, unit, *numbers)
            return cls(name, unit, mean=numbers[0], sd=numbers[1])
        items = [each.strip() for each in words.split(",")]
        if len(items) < 2 or not all(items):
            return None
        numeric = [_ITEM.fullmatch(each) for each in items]
        if not all(numeric):
            return cls(name, items=tuple(items))
        units = {(match[2] or "").strip() for match in numeric if match} - {""}
        if len(units) > 1:
            raise InputError(name, "must have one unit", words, "Write it once, at the end.")
        return cls(name, units.pop() if units else "", items=tuple(float(match[1]) for match in numeric if match))

    @property
    def words(self) -> str:
        """The distribution as a text, with its unit, as `parse` reads it after the name."""
        if self.items:
            written = ",".join(f"{each:g}" if isinstance(each, float) else str(each) for each in self.items)
        elif self.mean is None:
            written = f"{self.low:g}:{self.high:g}"
        elif self.limited:
            written = f"normal({self.mean:g}, {self.sd:g}, {self.low:g}, {self.high:g})"
        else:
            written = f"{self.mean:g}±{self.sd:g}"
        return f"{written} {self.unit}".strip()

    @property
    def limited(self) -> bool:
        return bool(np.isfinite(self.low) or np.isfinite(self.high))

    @property
    def whole(self) -> Scattered:
        """The whole numbers of a range, with equal chances; the input itself if it is a list."""
        if self.items:
            return replace(self, items=tuple(int(v) if isinstance(v, float) and v == int(v) else v for v in self.items))
        if self.mean is not None:
            raise InputError(self.name, "must be a range or a list of whole numbers", self.words)
        items = tuple(range(int(np.ceil(self.low)), int(np.floor(self.high)) + 1))
        if len(items) < 2:
            raise InputError(self.name, "must hold at least two whole numbers", self.words,
                             "A single value is no scatter: set it in the gears.")
        return replace(self, low=-np.inf, high=np.inf, items=items)

    @property
    def _tails(self) -> tuple[float, float]:
        """The distribution function of a normal input, without limits, at these."""
        from scipy.special import ndtr  # here and below, since it takes a tenth of a second to load

        low, high = (float(ndtr((end - (self.mean or 0.0)) / self.sd)) for end in (self.low, self.high))
        return low, high

    @property
    def cut(self) -> float:
        """The share of a normal distribution beyond the limits; 0 for any other."""
        if self.mean is None or not self.limited:
            return 0.0
        low, high = self._tails
        return 1.0 - (high - low)

    def at(self, u: np.ndarray) -> np.ndarray:
        """The values at probabilities u in (0, 1), of any shape, as numbers; of a list the indices of its items."""
        if self.items:
            return np.minimum((u * len(self.items)).astype(int), len(self.items) - 1)
        if self.mean is None:
            return self.low + u * (self.high - self.low)
        from scipy.special import ndtri

        low, high = self._tails
        return np.clip(self.mean + self.sd * ndtri(low + u * (high - low)), self.low, self.high)

    def given(self, value: float) -> Any:
        """A value as gears read it: an item of a list, or a number with its unit."""
        found = self.items[int(value)] if self.items else float(value)
        return f"{found!r} {self.unit}" if self.unit else found

    def narrowed(self, u: np.ndarray) -> np.ndarray | None:
        """Weights with which samples at probabilities u have the distribution with half the spread about the same
        middle: half the range, half the standard deviation and half the limits' distances. None for a list.
        """
        if self.items:
            return None
        if self.mean is None:
            return np.where(np.abs(u - 0.5) <= 0.25, 2.0, 0.0)
        value = self.at(u) - self.mean
        inside = (2 * value >= self.low - self.mean) & (2 * value <= self.high - self.mean)
        return np.where(inside, np.exp(-1.5 * (value / self.sd) ** 2), 0.0)


def as_text(given: Any) -> Any:
    """A distribution as a text, from a table ``{name, distribution, mean, sd, low, high}`` or ``values``, with a
    ``unit``; or ``within the grade`` alone; anything else as it is."""
    if not isinstance(given, Mapping):
        return given
    for key in given:
        if key not in _KEYS:
            raise unknown_name("key of vary", str(key), _KEYS)
    kind = given.get("distribution", "uniform")
    if kind not in _TAKES:
        raise unknown_name("distribution", str(kind), _TAKES)
    if kind == "list" and not isinstance(given.get("values"), (list, tuple)):
        raise InputError("vary", "must have a list of values", dict(given), _FORMS)
    taken = {"name", "distribution", "unit", *_TAKES[kind], *(("low", "high") if kind == "normal" else ())}
    for key in ("name", *_TAKES[kind], *given):
        if key not in given or key not in taken:
            raise InputError(f"vary.{key}", f"must {'be given' if key not in given else 'be left out'} for {kind}",
                             given.get(key), f"A {kind} distribution takes {', '.join(sorted(taken))}.")
    if kind == WITHIN:
        words = WITHIN
    elif kind == "list":
        words = ",".join(map(str, given["values"]))
    else:
        mean, sd, low, high = (to_float(f"vary.{key}", given[key]) if key in given else default for key, default in (
            ("mean", 0.0), ("sd", 0.0), ("low", -np.inf), ("high", np.inf)))
        words = f"{low!r}:{high!r}" if kind == "uniform" else f"normal({mean!r}, {sd!r}, {low!r}, {high!r})"
    return f"{given['name']}={words} {given.get('unit', '')}".strip()


def correlation_factor(
    inputs: Sequence[Scattered], correlations: Sequence[tuple[str, str, float]]
) -> np.ndarray | None:
    """The Cholesky factor (k, k) of the correlations of inputs; None without any.

    Raises `InputError` for inputs that are not there or are lists, and for correlations that no distribution has.
    """
    names, matrix = [each.name for each in inputs], np.eye(len(inputs))
    for first, second, value in correlations:
        for name in (first, second):
            if name not in names:
                raise unknown_name("correlations", name, names)
            if inputs[names.index(name)].items:
                raise InputError("correlations", "must be of inputs with a range or a normal distribution", name,
                                 "A list has no order.")
        at = names.index(first), names.index(second)
        if at[0] == at[1] or matrix[at]:
            raise InputError("correlations", "must name two different inputs, each pair once", [first, second])
        if not -1 < value < 1:
            raise InputError("correlations", "must be more than -1 and less than 1", [first, second, value])
        matrix[at] = matrix[at[::-1]] = value
    least = float(np.linalg.eigvalsh(matrix)[0])
    if least < 1e-12:
        raise InputError("correlations", "must be positive definite together", [list(each) for each in correlations],
                         f"The least eigenvalue of their matrix is {least:.3g}: no distribution has all of them. Bring "
                         "them nearer to 0.")
    return np.linalg.cholesky(matrix) if correlations else None


def correlated(u: np.ndarray, factor: np.ndarray | None) -> np.ndarray:
    """Independent probabilities u (..., k) as those of correlated inputs, by a Gaussian copula.

    A correlation is that of the normal variables of the copula: of normal inputs without limits their own. Inputs
    without correlations keep their values.
    """
    if factor is None:
        return u
    from scipy.special import ndtr, ndtri

    among = np.flatnonzero((factor @ factor.T - np.eye(len(factor))).any(axis=1))
    out = u.copy()
    out[..., among] = ndtr(ndtri(u)[..., among] @ factor[np.ix_(among, among)].T)
    return out


def probabilities(count: int, inputs: int, seed: int, indices: bool) -> np.ndarray:
    """Points in the unit cube, (blocks, scrambles, n, inputs), from scrambled Sobol sequences, ``count`` in all.

    Without indices there is one block. With them the first two are A and B, half of the points each, and of the others
    each is A with the values of one input from B: A. Saltelli et al., Comput. Phys. Commun. 181 (2010) 259.
    """
    from scipy.stats import qmc

    size, dimensions = (count // SCRAMBLES // 2, 2 * inputs) if indices else (count // SCRAMBLES, inputs)
    points = np.stack([qmc.Sobol(dimensions, rng=np.random.default_rng([seed, r])).random_base2(size.bit_length() - 1)
                       for r in range(SCRAMBLES)])
    points = np.clip(points, _EDGE, 1 - _EDGE)
    if not indices:
        return points[None]
    a, b = points[..., :inputs], points[..., inputs:]
    mixed = [np.where(np.arange(inputs) == i, b, a) for i in range(inputs)]
    return np.stack([a, b, *mixed])
