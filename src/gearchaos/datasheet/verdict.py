"""An assessment in words: the verdict, and the rows of its tables, with speeds rounded to the safe side."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from gearchaos.datasheet.answer import edges, listed, pair_title
from gearchaos.gears.geometry.root_stress import ROOT_STRESS
from gearchaos.gears.operating import is_design
from gearchaos.gears.units import measured
from gearchaos.studies.beside_factors import peak_root_stress, root_in_words
from gearchaos.studies.quasi_static import ratio_in_words
from gearchaos.studies.speed_windows import CONTACT_WORDS, INWARDS, UNBOUNDED, ends_in_words, range_in_words

if TYPE_CHECKING:
    from gearchaos.studies.assess import Assessment
    from gearchaos.studies.speed_windows import RandomStates, SpeedsToAvoid, UsableRange, Window

_MOST_NAMED = 3  # usable ranges, and torques, that a sentence names
_NARROWEST = 5e-4  # usable range that is named, as a share of the speeds that were looked through
_MOST_KEPT_OUT = 8  # ranges to keep out of that a list names


class Row(NamedTuple):
    """A range to avoid as a table shows it."""

    start: str
    stop: str
    happens: str
    begins_with: str
    ends_with: str
    factor: str
    at: str
    history: str
    likelihood: str


HEADINGS = Row("from\nrpm", "to\nrpm", "what happens", "begins\nwith", "ends\nwith", "dynamic\nfactor", "at\nrpm",
               "history\ndecides", "% of random\nstarts")
"""Of the columns of a table of ranges to avoid."""


def torques_in_words(found: Assessment) -> str:
    """The torques with their unit: "100 and 300 N m", or how many there are."""
    return _torques([each.torque for each in found.at])


def _torques(values: Sequence[float]) -> str:
    torques = [f"{each:.6g}" for each in values]
    if len(torques) > _MOST_NAMED:
        return f"{len(torques)} torques from {torques[0]} to {torques[-1]} N m"
    return f"{listed(torques)} N m"


def scanned(found: Assessment) -> str:
    """The range of speeds that was looked through."""
    return f"{range_in_words(*found.speeds)} rpm"


def usable_in_words(parts: Sequence[UsableRange], speeds: tuple[float, float]) -> list[str]:
    """Usable ranges with their margins, rounded inwards, without those that are next to nothing of the ``speeds`` that
    were looked through.

    An end of these is marked: the range may go on beyond.
    """
    least = _NARROWEST * (speeds[1] - speeds[0])
    named = [(part, *ends_in_words(part.start, part.stop, INWARDS)) for part in parts if part.stop - part.start > least]
    return [f"{'≤ ' * (part.start == speeds[0])}{low} to {'≥ ' * (part.stop == speeds[1])}{high} rpm "
            f"({part.margin_words})" for part, low, high in named]


def verdict(found: Assessment) -> str:
    """What to use and what to avoid at all torques, in a sentence."""
    where, torques, usable = scanned(found), torques_in_words(found), usable_in_words(found.usable_at_all, found.speeds)
    criterion = found.at[0].criterion
    if not found.avoid:
        return (f"usable at {torques}: all of {where}; looked for were speeds at which {criterion}, and none found "
                f"{found.tried}")
    if not usable:
        some = usable_in_words([part for _, part in found.usable], found.speeds)  # none, too, of a single torque
        return f"no speed from {where} is usable at {torques}: {criterion}{'; some are at single torques' * bool(some)}"
    more = len(usable) - _MOST_NAMED
    narrower = f" and {more} narrower range{'s' * (more > 1)}" if more > 0 else ""
    return (f"usable at {torques}: {', '.join(usable[:_MOST_NAMED])}{narrower}; avoid the rest of {where}, where in "
            f"some motion {criterion}")


def worst(found: Assessment) -> str:
    """The largest dynamic factor of all, and in how many of the ranges to avoid the history decides."""
    unbounded = [f"{each.torque:.6g}" for each in found.at if not all(
        math.isfinite(one.dynamic_factor) for window in each.windows for one in window.reached)]
    if unbounded:
        more = " and more" * (len(unbounded) > _MOST_NAMED)
        return f"motions grow without bound at {listed(unbounded[:_MOST_NAMED])} N m{more}"
    part, at = max(((each.largest, each) for each in found.at), key=lambda pair: pair[0].dynamic_factor)
    history = sum(window.depends_on_history for _, window in found.avoid)
    of_all = f"{history} of {len(found.avoid)}"
    others = sum(window.by_others for _, window in found.avoid)
    decides = f"; in {of_all} ranges to avoid the history decides which motion is met" * bool(history)
    decides += f", {others} of these only other initial states lead to" * bool(others)
    there = at.dataset.sel(speed=part.speed_of_largest)
    contact = there["contact"].values[there["dynamic_factor"].values == part.dynamic_factor].max()
    meaning = ", where the teeth hit both flanks: a reason to avoid that speed, not a load" * int(contact == 2)
    root = root_in_words(found.gears, at.torque, part.dynamic_factor)
    return (f"the largest dynamic factor found is {measured(part.dynamic_factor, 3)}{root}, at "
            f"{part.largest_at} rpm and {at.torque:.6g} N m{meaning}{_largest_root(found, at.torque)}{decides}")


def _largest_root(found: Assessment, torque: float) -> str:
    """The largest root stress where it is at another torque than the largest dynamic factor; empty where it is not."""
    peaks = [(peak_root_stress(found.gears, each.torque, each.largest.dynamic_factor), each) for each in found.at]
    known = [(max(stress), each) for stress, each in peaks if stress is not None]
    if not known:
        return ""
    stress, at = max(known, key=lambda pair: pair[0])
    if at.torque == torque:
        return ""
    return (f"; the largest root stress {measured(stress, 3)} {ROOT_STRESS.unit}, at {at.largest.largest_at} rpm and "
            f"{at.torque:.6g} N m")


def keep_out(found: Assessment, most: int = _MOST_KEPT_OUT) -> list[str]:
    """The ranges to avoid with what happens there and from how many random states, rounded outwards.

    Where there are more than so many, those that overlap, also at different torques, are merged, and the widest named.
    """
    merged = [[pair] for pair in found.avoid]
    if len(merged) > most:
        merged = []
        for pair in sorted(found.avoid, key=lambda pair: pair[1].reach):
            if merged and pair[1].reach[0] <= max(window.reach[1] for _, window in merged[-1]):
                merged[-1].append(pair)
            else:
                merged.append([pair])
    widest = sorted(merged, key=_width)[-most:]
    more = len(merged) - len(widest)
    return [_kept_out(part) for part in merged if part in widest] + (
        [f"{more} narrower range{'s' * (more > 1)}, in the tables"] if more else [])


def _width(part: Sequence[tuple[float, Window]]) -> float:
    return max(window.reach[1] for _, window in part) - part[0][1].reach[0]


def _kept_out(part: Sequence[tuple[float, Window]]) -> str:
    """A range to keep out of, made of ranges to avoid that overlap: where, what happens, and the share of starts."""
    first, last = part[0][1], max((window for _, window in part), key=lambda each: each.reach[1])
    where, torques = f"{edges(first)[0]} to {edges(last)[1]} rpm", _torques(sorted({torque for torque, _ in part}))
    if len(part) == 1:
        return f"{where} at {torques}: {first.cause}, {likelihood(first)}"
    torque, worst = max(part, key=lambda pair: (CONTACT_WORDS.index(pair[1].contact), pair[1].dynamic_factor))
    shares = [window.random_states.fraction for _, window in part if window.random_states]
    ends = list(dict.fromkeys(map(_percent, (min(shares), max(shares))))) if shares else []
    return f"{where}, {len(part)} ranges at {torques} merged: at worst {worst.cause} at {torque:.6g} N m" + (
        f"; from {' to '.join(ends)} % of random starts, by range and torque" if ends else "")


def likelihood(window: Window) -> str:
    """From which share of random initial states a range's motion to avoid is reached, with its 95 % interval."""
    found = window.random_states
    if found is None:
        return "no random starts tried"
    part = _history(window)
    behind = f"{found.states} at {found.speeds} speed{'s' * (found.speeds > 1)}" + (
        f", where the history decides: {part} rpm" if part not in ("no", "yes") else "")
    if found.fraction == 1:
        return f"from every random start tried, {behind}"
    return f"from {_percent(found.fraction)} % of random starts (95 %: {_interval(found)} %), {behind}"


def _percent(share: float) -> str:
    """A share in percent; 0 and 100 are none and all."""
    if 0 < share < 0.01:
        return f"{100 * share:.1g}"
    return f"{100 if share == 1 else min(round(100 * share), 99)}"


def _interval(found: RandomStates) -> str:
    """The interval of a share in percent, rounded outwards."""
    return f"{math.floor(100 * found.fraction_lo)}–{math.ceil(100 * found.fraction_hi)}"


def rows(at: SpeedsToAvoid) -> list[Row]:
    """The ranges to avoid at a torque, rounded outwards."""
    return [_row(window) for window in at.windows]


def at_no_speed(at: SpeedsToAvoid) -> str:
    """The dynamic factor that the jumps of the stiffness make at any speed; empty where it is 1, or not known."""
    ratio = ratio_in_words(at.quasi_static_ratio)
    return f"dynamic factor {ratio} at speed 0" if ratio else ""


def _row(window: Window) -> Row:
    shares = window.random_states
    bounded = window.contact != UNBOUNDED
    begins = _event(window.begins_with, window.start_resolution, window.from_scan_start)
    return Row(*edges(window), window.cause, begins,
               _event(window.ends_with, window.stop_resolution, window.to_scan_end),
               measured(window.dynamic_factor, 3) if bounded else "unbounded",
               window.largest_at if bounded else "–",
               "others" if window.by_others else _history(window), "–" if shares is None
               else f"{_percent(shares.fraction)} ({_interval(shares)})")


def _history(window: Window) -> str:
    """Whether the history decides in a range, or in which part of it."""
    if window.history is None:
        return "no"
    low, high = (words if own != end else "" for words, own, end in zip(
        ends_in_words(*window.history), window.history, (window.start, window.stop), strict=True))
    return f"{low}–{high}" if low and high else f"from {low}" if low else f"to {high}" if high else "yes"


def _event(kind: str, resolution: float, scan_end: bool) -> str:
    """The event at an edge, and how well it is known; a dash where a motion that does not repeat ends."""
    if scan_end:
        return "end of scan"
    return (kind or "–") + (f" ±{measured(resolution, 2)}" if resolution else "")


def jumps(found: Assessment) -> list[str]:
    """The jumps of slow run-ups and run-downs, each in words."""
    ways = {"up": "run-up", "down": "run-down"}
    return [f"{ways[jump.direction]} at {each.torque:.6g} N m: {jump.speed:.0f} rpm, {jump.event or 'no event'}, "
            f"dynamic factor {measured(jump.factor_before, 3)} to {measured(jump.factor_after, 3)}"
            for each in found.at for jump in each.jumps]


def title(gears: Any) -> str:
    """What was assessed."""
    if is_design(gears):
        return pair_title(gears)
    if hasattr(gears, "meshes"):
        return f"Gear train, {len(gears.bodies)} bodies, {len(gears.meshes)} meshes"
    return f"Gear pair {gears.n1}/{gears.n2}"
