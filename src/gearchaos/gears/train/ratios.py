"""How fast the bodies of a train turn steadily: linear equations in exact fractions, one for each mesh and shaft."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from fractions import Fraction
from typing import Any

from gearchaos.errors import InputError
from gearchaos.gears.train.mesh import Mesh
from gearchaos.gears.train.parts import GROUND, field_of


def steady_ratios(names: list[str], first: str, equations: Iterable[tuple[Any, Mapping[str, Fraction]]]
            ) -> dict[str, Fraction]:
    """The speeds that satisfy linear equations Σ factor × speed = 0, each with its part, the first being 1.

    Raises `InputError` where they contradict each other, or leave one open.
    """
    solved: dict[str, dict[str, Fraction]] = {}  # a speed as a combination of others, which are not solved for
    for part, row in equations:
        left: dict[str, Fraction] = {}
        for name, factor in row.items():
            for other, share in solved.get(name, {name: Fraction(1)}).items():
                left[other] = left.get(other, Fraction(0)) + factor * share
        left = {name: factor for name, factor in left.items() if factor}
        unknown = [name for name in left if name != first]
        if not left:
            continue
        if not unknown:
            known = {name: solved.get(name, {name: Fraction(1)}) for name in row}
            raise _contradiction(part, row, first, {
                name: value.get(first, Fraction(0)) for name, value in known.items() if value.keys() <= {first}})
        chosen = unknown[-1]
        value = {name: -factor / left[chosen] for name, factor in left.items() if name != chosen}
        for name, row_of in solved.items():
            if chosen in row_of:
                share = row_of.pop(chosen)
                for other, factor in value.items():
                    row_of[other] = row_of.get(other, Fraction(0)) + share * factor
                solved[name] = {n: f for n, f in row_of.items() if f}
        solved[chosen] = value
    for name in names:
        if name != first and (name not in solved or solved[name].keys() - {first}):
            raise InputError(f"body {name}", "must have a speed that follows from the numbers of teeth", "none",
                             f"Hold it, or another body, by fixed = true or a shaft to '{GROUND}'.")
    return {name: Fraction(1) if name == first else solved[name].get(first, Fraction(0)) for name in names}


def _contradiction(part: Any, row: Mapping[str, Fraction], first: str, known: Mapping[str, Fraction]) -> InputError:
    """The error for a mesh or a shaft with which the parts before it could not turn; ``known`` ratios of its bodies."""
    teeth = f"{part.teeth[0]}/{part.teeth[1]}" if isinstance(part, Mesh) else list(part.between)
    field = field_of(part, "teeth" if isinstance(part, Mesh) else "between")
    held = [name for name, ratio in known.items() if not ratio]
    if len(known) != 2 or len(row) != 2 or len(held) == 1:
        why = f"{held[0]} is held" if held else "it is held" if GROUND in part.between else "its loop holds it"
        return InputError(field, "must let the parts turn", teeth, f"{first} could not turn, since {why}.")
    (a, factor), (b, other) = sorted(row.items(), key=lambda item: item[0] == first, reverse=True)
    wanted = known[a] * -factor / other
    advice = (f"By the other parts {b} turns {float(known[b]):.6g} times as fast as {first}, by this one "
              f"{float(wanted):.6g} times.")
    if wanted == -known[b]:
        advice += " A loop of an odd number of external meshes cannot turn."
    return InputError(field, "must agree with the loop that it closes", teeth, advice)
