"""What is printed of a gear design: the answer, and with ``--all`` the datasheet, in lines of 80 columns."""

from __future__ import annotations

import textwrap
from itertools import groupby
from typing import TYPE_CHECKING

from gearchaos.cli.avoided import print_avoided, say_lines
from gearchaos.cli.errors import PAGE_WIDTH, say
from gearchaos.cli.output import plain_table, print_table
from gearchaos.gears.io.units import measured

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gearchaos.datasheet.answer import DesignAnswer

_MOST_WARNINGS, _SHOWN_SPEEDS = 3, 8
"""Warnings that are shown in an answer; speeds for which dynamic factors by the standards are printed."""


def print_answers(answers: Sequence[DesignAnswer], every: bool, warn: bool) -> None:
    """Print the answer at each torque, then the warnings if there are to be some.

    What to do comes first, then the ranges to avoid, and what the answer rests on.
    """
    notes = list(dict.fromkeys(note for answer in answers for note in answer.notes)) if warn else []
    most, lines = (None, None) if every else (_MOST_WARNINGS, 2)
    warnings = [line for text in notes[:most] for line in _wrapped(f"warning: {text}", 2, lines)]
    if more := len(notes) - len(notes[:most]):
        warnings.append(f"and {more} more warning{'s' * (more > 1)}: --all shows them")
    for number, answer in enumerate(answers):
        print(end="\n" * (number > 0))
        head = [("speeds to avoid", answer.conclusion)] * (answer.speeds is None)
        if answer.speeds is not None:
            from gearchaos.datasheet.assessment import avoided

            say_lines(*answer.decision)
            print_avoided(avoided(answer.speeds, answer.design, every))
        print("\n".join([answer.pair, *(line for name, text in (*answer.facts, *head)
                                         for line in _wrapped(f"{name:<16}{text}", 16))]))
        print(*(line for text in answer.basis for line in _wrapped(text)), sep="\n", flush=True)
    for line in warnings:
        say(line)


def _wrapped(text: str, indent: int = 0, most: int | None = None) -> list[str]:
    """A text as lines, at most so many, all but the first with an indent."""
    return textwrap.wrap(text, PAGE_WIDTH, subsequent_indent=" " * indent, break_on_hyphens=False, max_lines=most,
                         placeholder=" … (--all)")


def print_datasheets(answers: Sequence[DesignAnswer]) -> None:
    """Print the datasheet of the first answer, what differs from it in the others, and K_v by the standards.

    Quantities are in groups, each above its formula and source, then the reasons why others have no value.
    """
    from gearchaos.gears.dynamic_factor import standards
    from gearchaos.studies.operation.quasi_static import ratio_in_words
    from gearchaos.studies.speeds.speed_windows import speed_in_words

    first = answers[0]
    for answer in answers:
        entries, absent = first.entries, first.absent
        if answer is not first:
            print(f"\nWhat differs at {answer.design.torque:.6g} N m")
            entries, absent = answer.differing(first), [each for each in answer.absent if each not in first.absent]
        for group, members in groupby(entries.items(), key=lambda item: item[1].group):
            print(f"\n{group}")
            for name, e in members:
                values = e.shown if isinstance(e.shown, tuple) else (e.shown,)
                text = "–" if e.value is None else ", ".join(f"{v:.6g}" for v in values) or "none"
                print(*_wrapped(f"  {name:<32}{e.symbol:<13}{text} {e.unit}".rstrip(), 47), sep="\n")
                reason = e.reason if e.expected else e.formula
                print(*(f"      {line}" for line in textwrap.wrap(f"{reason} [{e.source}]", PAGE_WIDTH - 6)), sep="\n")
        if absent:
            print("\nNot computed")
        for reason, names in absent:
            print(*_wrapped(f"  {', '.join(names)}: {reason}", 6), sep="\n")
        if answer.speeds is None:
            continue
        print("\nLargest dynamic factor at a few of the speeds, and K_v by the standards")
        print(f"(computed: mesh damping {answer.design.law.words})")
        ds = answer.speeds.dataset
        largest = ds["dynamic_factor"].max("motion")
        ratio = answer.speeds.quasi_static_ratio
        over = {"over quasi-static": largest / ratio} if ratio_in_words(ratio) else {}
        columns = {"computed": largest, **over, **{each.heading: ds[each.name] for each in standards()}}
        table = plain_table("rpm", *columns)
        speeds = ds["speed"].values
        apart = (speeds[-1] - speeds[0]) / _SHOWN_SPEEDS
        for i in sorted({round(i * (ds.sizes["speed"] - 1) / (_SHOWN_SPEEDS - 1)) for i in range(_SHOWN_SPEEDS)}):
            table.add_row(speed_in_words(speeds[i], apart), *(measured(float(each[i])) for each in columns.values()))
        print_table(table)
