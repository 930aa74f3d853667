"""What is printed of a gear design: the answer, and with ``--all`` the datasheet, in lines of 80 columns."""

from __future__ import annotations

import math
import textwrap
from itertools import groupby
from typing import TYPE_CHECKING

from gearchaos.cli.errors import say
from gearchaos.cli.output import plain_table, print_table
from gearchaos.datasheet.answer import edges, factor_and_share
from gearchaos.gears.units import measured
from gearchaos.model import DAMPING_LAWS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gearchaos.datasheet.answer import Answer
    from gearchaos.studies.speed_windows import SpeedsToAvoid

_WIDTH = 80
_MOST_LINES, _FEWEST_WINDOWS, _MOST_WARNINGS = 20, 2, 3
"""Lines of an answer; ranges and warnings that are shown in it."""

_MOST_NAMED, _SHOWN_SPEEDS = 3, 8
"""Ranges without a row of which both ends are named; speeds for which dynamic factors by the standards are printed."""


def print_answers(answers: Sequence[Answer], every: bool, warn: bool) -> None:
    """Print the answer at each torque, then the warnings if there are to be some.

    One answer has at most 20 lines with its warnings, or with ``every`` all that is known.
    """
    notes = list(dict.fromkeys(note for answer in answers for note in answer.notes)) if warn else []
    most, lines = (None, None) if every else (_MOST_WARNINGS, 2)
    warnings = [line for text in notes[:most] for line in _wrapped(f"warning: {text}", 2, lines)]
    if more := len(notes) - len(notes[:most]):
        warnings.append(f"and {more} more warning{'s' * (more > 1)}: --all shows them")
    for number, answer in enumerate(answers):
        windows, found = answer.speeds.windows if answer.speeds else (), answer.conclusion
        if answer.speeds and windows:
            found = f"{len(windows)} range{'s' * (len(windows) > 1)} in {answer.scanned}: {answer.speeds.criterion}"
        facts = [*answer.facts, ("speeds to avoid", found)]
        head = [answer.pair, *(line for name, text in facts for line in _wrapped(f"{name:<16}{text}", 16))]
        basis = [line for text in answer.basis for line in _wrapped(text)]
        print("\n" * (number > 0) + "\n".join(head))
        if answer.speeds and windows:
            room = _MOST_LINES - len(warnings) - len(head) - len(basis) - 2  # of the heading
            _print_windows(answer.speeds, len(windows) if every else max(room, _FEWEST_WINDOWS))
        print(*basis, sep="\n", end="\n" * bool(basis), flush=True)
    for line in warnings:
        say(line)


def _wrapped(text: str, indent: int = 0, most: int | None = None) -> list[str]:
    """A text as lines, at most so many, all but the first with an indent."""
    return textwrap.wrap(text, _WIDTH, subsequent_indent=" " * indent, break_on_hyphens=False, max_lines=most,
                         placeholder=" … (--all)")


def _print_windows(speeds: SpeedsToAvoid, most: int) -> None:
    """Print ranges to avoid in so many rows: those with the largest factors, and how many others there are.

    First of all are those in which a motion diverges.
    """
    from gearchaos.studies.quasi_static import ratio_in_words
    from gearchaos.studies.speed_windows import CRITERION, MOTIONS

    most -= len(speeds.windows) > most
    forces, ratio = len({each.criterion for each in speeds.windows}) > 1, ratio_in_words(speeds.quasi_static_ratio)
    table = plain_table(
        "from\nrpm", "to\nrpm", "factor\nfrom rest", "speed\nrising", "speed\nfalling", "other\nstarts",  # MOTIONS
        "largest\nat rpm", *(["quasi-\nstatic"] * bool(ratio)), *(["teeth"] * forces), left=["teeth"])
    by_factor = sorted(speeds.windows, key=lambda each: -math.inf if any(
        math.isnan(motion.dynamic_factor) for motion in each.reached) else -each.dynamic_factor)
    shown_ones = sorted(by_factor[:most], key=lambda each: each.start)
    for each in shown_ones:
        reached = {r.motion: factor_and_share(r) for r in each.reached}
        factors = (reached.get(words, "-") for words in MOTIONS.values())
        teeth = "apart" if each.criterion == CRITERION else "touch"
        table.add_row(*edges(each), *factors, each.largest_at, *([ratio] * bool(ratio)), *([teeth] * forces))
    print_table(table)
    if hidden := [edges(each) for each in sorted(by_factor[most:], key=lambda each: each.start)]:
        named = ", ".join(map(" to ".join, hidden))
        if len(hidden) > _MOST_NAMED:
            named = f"{len(hidden)} more between {hidden[0][0]} and {hidden[-1][1]}"
        print("\n".join(textwrap.wrap(f"and with smaller factors {named} rpm: --all shows them", 80)))


def print_datasheets(answers: Sequence[Answer]) -> None:
    """Print the datasheet of the first answer, what differs from it in the others, and K_v by the standards.

    Quantities are in groups, each above its formula and source, then the reasons why others have no value.
    """
    from gearchaos.gears.dynamic_factor import standards
    from gearchaos.studies.speed_windows import speed_in_words

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
                print(*(f"      {line}" for line in textwrap.wrap(f"{reason} [{e.source}]", _WIDTH - 6)), sep="\n")
        if absent:
            print("\nNot computed")
        for reason, names in absent:
            print(*_wrapped(f"  {', '.join(names)}: {reason}", 6), sep="\n")
        if answer.speeds is None:
            continue
        print("\nLargest dynamic factor at a few of the speeds, and K_v by the standards")
        print(f"(computed: mesh damping {DAMPING_LAWS[answer.design.damping_law]})")
        ds = answer.speeds.dataset
        largest = ds["dynamic_factor"].max("motion")
        over = {"over quasi-static": largest / answer.speeds.quasi_static_ratio} if answer.quasi_static else {}
        columns = {"computed": largest, **over, **{each.heading: ds[each.name] for each in standards()}}
        table = plain_table("rpm", *columns)
        speeds = ds["speed"].values
        apart = (speeds[-1] - speeds[0]) / _SHOWN_SPEEDS
        for i in sorted({round(i * (ds.sizes["speed"] - 1) / (_SHOWN_SPEEDS - 1)) for i in range(_SHOWN_SPEEDS)}):
            table.add_row(speed_in_words(speeds[i], apart), *(measured(float(each[i])) for each in columns.values()))
        print_table(table)
