"""Mutation operators: those of cosmic-ray that suit this code, and two more."""

from __future__ import annotations

import re
from ast import literal_eval
from collections.abc import Iterator
from functools import cache
from itertools import permutations
from typing import Any

import parso
from cosmic_ray.operators import binary_operator_replacement as binary
from cosmic_ray.operators import (
    boolean_replacer,
    break_continue,
    exception_replacer,
    number_replacer,
    operator,
    remove_decorator,
    unary_operator_replacement,
    zero_iteration_for_loop,
)
from cosmic_ray.operators import comparison_operator_replacement as comparison

_ARITHMETIC = ("Add", "Sub", "Mul", "Div", "FloorDiv", "Mod", "Pow")
_BITS = ("BitAnd", "BitOr", "BitXor")
_COMPARISONS = ("Eq", "NotEq", "Lt", "LtE", "Gt", "GtE")
_TWINS = (
    ("low", "high"), ("up", "down"), ("least", "most"), ("rows", "columns"), ("row", "column"), ("first", "last"),
    ("start", "stop"), ("sin", "cos"), ("minimum", "maximum"), ("min", "max"), ("any", "all"), ("begin", "end"),
)
_TEXT = ("name", "string", "fstring_string")
_NAMED_ELSEWHERE = ("import_from", "import_as_name", "import_as_names", "funcdef", "param", "tfpdef", "classdef")
"""Parent nodes in which another name would be an error on import."""


class ScaleFloat(operator.Operator):
    """Multiplies a float by 100 or 0.01; cosmic-ray adds or subtracts 1, which is too coarse for 1e-9."""

    def mutation_positions(self, node: Any) -> Iterator[Any]:
        if node.type == "number" and isinstance(literal_eval(node.value), float):
            yield from [(node.start_pos, node.end_pos)] * 2

    def mutate(self, node: Any, index: int) -> Any:
        return parso.python.tree.Number(f" {literal_eval(node.value) * (100.0, 0.01)[index]!r}", node.start_pos)

    @classmethod
    def examples(cls) -> tuple[operator.Example, ...]:
        return (operator.Example("x = 1e-6", "x =  0.0001"),)


class SwapTwins(operator.Operator):
    """Replaces a name by its counterpart: wheel 1 for wheel 2, low for high, rows for columns."""

    def mutation_positions(self, node: Any) -> Iterator[Any]:
        if node.type in _TEXT and node.parent.type not in _NAMED_ELSEWHERE and _is_there(_twin(node.value), node):
            yield node.start_pos, node.end_pos

    def mutate(self, node: Any, index: int) -> Any:
        node.value = _twin(node.value)
        return node

    @classmethod
    def examples(cls) -> tuple[operator.Example, ...]:
        return (operator.Example("x = beta1", "x = beta2"),)


def _is_there(twin: str, node: Any) -> bool:
    """Whether the counterpart is another name that also occurs in the file."""
    return twin != node.value and twin in _words(node.get_root_node())


@cache
def _words(tree: Any) -> set[str]:
    leaf, words = tree.get_first_leaf(), set()
    while leaf := leaf.get_next_leaf():
        words.add(leaf.value if leaf.type in _TEXT else "")
    return words


def _twin(text: str) -> str:
    numbered = re.sub(r"(?<=[A-Za-z_])([12])(?=\b|_)", lambda m: "21"[int(m[1]) - 1], text)
    if numbered != text:
        return numbered
    for pair in _TWINS:
        for one, other in (pair, pair[::-1]):
            if (found := re.sub(rf"(?<![A-Za-z]){one}(?![A-Za-z])", other, text)) != text:
                return found
    return text


def _pairs(module: Any, family: str, *groups: tuple[str, ...]) -> list[Any]:
    names = [f"{family}_{a}_{b}" for group in groups for a, b in permutations(group, 2)]
    return [getattr(module, name) for name in names if hasattr(module, name)]


FAMILIES: dict[str, list[Any]] = {
    "arithmetic": _pairs(binary, "ReplaceBinaryOperator", _ARITHMETIC, _BITS),
    "comparison": _pairs(comparison, "ReplaceComparisonOperator", _COMPARISONS, ("Is", "IsNot")),
    "sign": [
        op for op in unary_operator_replacement.operators()
        if op.__name__.split("_")[1] == "Delete" or set(op.__name__.split("_")[1:]) == {"UAdd", "USub"}
    ],
    "logic": [
        boolean_replacer.ReplaceTrueWithFalse, boolean_replacer.ReplaceFalseWithTrue,
        boolean_replacer.ReplaceAndWithOr, boolean_replacer.ReplaceOrWithAnd, boolean_replacer.AddNot,
    ],
    "flow": [
        break_continue.ReplaceBreakWithContinue, break_continue.ReplaceContinueWithBreak,
        exception_replacer.ExceptionReplacer, remove_decorator.RemoveDecorator,
        zero_iteration_for_loop.ZeroIterationForLoop,
    ],
    "number": [number_replacer.NumberReplacer, ScaleFloat],
    "twin": [SwapTwins],
}
"""Operators by what they change. Replacements that fail at once, such as a bit shift of floats, are left out."""
