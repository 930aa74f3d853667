"""An assessment in words: the verdict, and the rows of its tables, with speeds rounded to the safe side.

Terminal, page, PDF and explorer all say these words. They are parts of sentences; `sentence` makes whole ones.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gearchaos.datasheet.quantities import pair_title
from gearchaos.dynamics.response import MESH
from gearchaos.gears.geometry.root_stress import ROOT_STRESS
from gearchaos.gears.io.units import measured
from gearchaos.gears.operation.operating import is_design
from gearchaos.studies.operation.beyond_the_teeth import BEYOND
from gearchaos.studies.operation.factor_context import peak_root_stress, root_in_words
from gearchaos.studies.operation.quasi_static import ratio_in_words
from gearchaos.studies.operation.severities import SEVERITIES
from gearchaos.studies.speeds.speed_windows import (
    FEW,
    INWARDS,
    MOTIONS,
    OPERATION,
    ends_in_words,
    range_in_words,
    speed_in_words,
)

if TYPE_CHECKING:
    from gearchaos.studies.speeds.assess import Assessment
    from gearchaos.studies.speeds.speed_windows import RandomStates, SpeedsToAvoid, UsableRange, Window

NARROW = 8  # columns of a table of ranges to avoid where there is no room for the events at the edges
_MOST_NAMED = 3  # usable ranges, and torques, that a sentence names
_MOST_RANGES = 4  # to avoid, that a sentence names
_NARROWEST = 5e-4  # usable range that is named, as a share of the speeds that were looked through
_MOST_KEPT_OUT = 8  # ranges to keep out of that a list names


class Row(NamedTuple):
    """A range to avoid as a table shows it."""

    start: str
    stop: str
    happens: str
    reached: str
    factor: str
    at: str
    root: str
    share: str
    begins_with: str
    ends_with: str


class Section(NamedTuple):
    """A part of what is said, under its heading: a table, whose first row are its headings, words for sentences, items
    of a list, and values by name."""

    heading: str
    table: Sequence[Sequence[str]] = ()
    words: Sequence[str] = ()
    items: Sequence[str] = ()
    values: Sequence[tuple[str, str]] = ()

    @classmethod
    def of(cls, heading: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> Section:
        """A table, or that there is nothing to show in one."""
        return cls(heading, [columns, *rows]) if rows else cls(heading, words=["nothing"])


_HEADINGS = Row("from\nrpm", "to\nrpm", "what happens", "met", "dynamic\nfactor", "at\nrpm", "root\nN/mm²",
                "% of load\nchanges", "begins\nwith", "ends\nwith")
_STATES = {MOTIONS["load change"]: "load changes", MOTIONS["other"]: "wide states"}


def headings(at: SpeedsToAvoid) -> Row:
    """Of the columns of a table of ranges to avoid."""
    return _HEADINGS._replace(share="% of wide\nstates") if at.wide else _HEADINGS


def sentence(words: str) -> str:
    """Words as a sentence, which ends with a colon where a list follows."""
    return f"{words[0].upper()}{words[1:]}{'.' * (words[-1] != ':')}"


def listed(words: Sequence[str], word: str = "and") -> str:
    """Words with commas, and "and" or another ``word`` before the last."""
    return f" {word} ".join(filter(None, [", ".join(words[:-1]), words[-1]]))


def edges(window: Window) -> tuple[str, str]:
    """Both ends of a range to avoid, in rpm, rounded outwards; an end of the computed speeds is marked, beyond which it
    may go on.
    """
    start, stop = window.ends
    return f"{'≤ ' * window.from_scan_start}{start}", f"{'≥ ' * window.to_scan_end}{stop}"


def scope(found: Assessment) -> str:
    """The speeds and the torques that were looked through."""
    return f"{_scanned(found)} at {_torques([each.torque for each in found.at])}"


def _torques(values: Sequence[float], word: str = "and") -> str:
    torques = [f"{each:.6g}" for each in values]
    if len(torques) > _MOST_NAMED:
        return f"{'any of ' * (word == 'or')}{len(torques)} torques from {torques[0]} to {torques[-1]} N m"
    return f"{listed(torques, word)} N m"


def _scanned(found: Assessment) -> str:
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


def decision(found: Assessment) -> list[str]:
    """What to do, in sentences: speeds to avoid in operation, and where the load may change; usable speeds."""
    at, torques = found.at[0], _torques([each.torque for each in found.at], "or")
    windows = [window for each in found.at for window in each.windows]
    idle = [*_unloaded(found)]
    met = [window for window in windows if window.operation]
    first = f"at {torques} avoid {_ranges(met)}: {_at_worst(met)}" if met else (
        f"at {torques} no speed from {_scanned(found)} is to be avoided in operation: none was found at which "
        f"{at.criterion}")
    if not at.load_change:
        return [*idle, first, *_usable(found)]
    # which ranges load changes add to those of operation, and the factor that these then reach if it is larger
    met_from = [(part[0].reach[0], _stop(part)) for part in _merged(met)]
    more = [window for window in windows if not window.operation and not any(
        low <= window.reach[0] and window.reach[1] <= high for low, high in met_from)]
    words = f"avoid also {_ranges(more)}: {_at_worst(more)}" if more else (
        "avoid the same speeds" if met else "nothing is to be avoided, either")
    larger = [each.largest_after_load_change for each in windows if each.largest_after_load_change]
    if larger:
        most = max(larger, key=lambda each: each.dynamic_factor)
        words += (f"; in the ranges before, the factor then reaches {measured(most.dynamic_factor, 3)} at "
                  f"{speed_in_words(most.speed, 0)} rpm")
    return [*idle, first, f"where {'' if at.wide else 'there may be '}{at.load_change}, {words}", *_usable(found)]


def _unloaded(found: Assessment) -> Iterator[str]:
    """Which meshes of a train carry nothing at rest, as those of a planet whose pin is too far from its place, at which
    torques, and whether all ranges to avoid are those of their rattle."""
    for names in dict.fromkeys(each.unloaded for each in found.at):
        at = [each for each in found.at if each.unloaded == names]
        if names and any(each.windows for each in at):
            others = any(not window.meshes or {*window.meshes} - {*names} for each in at for window in each.windows)
            carry = "carry" if len(names) > 1 else "carries"
            yield (f"at {_torques([each.torque for each in at])} {listed(names)} {carry} no load at rest: " + (
                "ranges to avoid include those of that rattle" if others else
                "what is to be avoided is that rattle alone, no other mesh separates"))


def _ranges(windows: Sequence[Window]) -> str:
    """Ranges to avoid, those that overlap as one, the widest by name, before rare ones, and narrow ones gathered."""
    merged = _merged(windows)
    wide = sorted((part for part in merged if not all(each.narrow for each in part)),
                  key=lambda part: (not _rarely(part), _stop(part) - part[0].reach[0]))[-_MOST_RANGES:]
    shown = [f"{edges(part[0])[0]} to {edges(max(part, key=lambda each: each.reach[1]))[1]}{_by_history(part)}"
             f"{_rarely(part)}" for part in merged if part in wide]
    others = [part for part in merged if part not in wide]
    words = f"{listed(shown)} rpm" if shown else ""
    kind = "narrower or rarer" if shown and any(map(_rarely, others)) else "narrower" if shown else "narrow"
    few = f"{len(others)} {kind} range{'s' * (len(others) > 1)}" if others else ""
    return " and ".join(filter(None, [words, few]))


def _rarely(part: Sequence[Window]) -> str:
    """After how few load changes a range is met, the most of those that make it up; empty if it is not rare."""
    shares = [each.random_states for each in part if each.rare and each.random_states]
    if len(shares) < len(part):
        return ""
    most = max(shares, key=lambda each: each.fraction)
    return f" (rarely, {_percent(most.fraction)} % of {_STATES[most.motion]})"


def _by_history(part: Sequence[Window]) -> str:
    """Where in a range, if it is one alone, it depends on the speeds before whether it is to be avoided."""
    if len(part) > 1 or part[0].history is None:
        return ""
    low, high = (speed_in_words(speed, 0) for speed in part[0].history)
    begins, ends = part[0].history[0] <= part[0].start, part[0].history[1] >= part[0].stop
    where = "" if begins and ends else f"to {high} " if begins else f"from {low} " if ends else f"{low} to {high} "
    return f" ({where}by history)"


def _merged(ranges: Iterable[Any], window: Callable[[Any], Window] = lambda each: each) -> list[list[Any]]:
    """Ranges that overlap or meet, as they are printed, as one, in rising order of their starts; ``window`` says where
    each is."""
    out: list[list[Any]] = []
    for each in sorted(ranges, key=lambda each: window(each).reach):
        last = max(map(window, out[-1]), key=lambda one: one.reach[1]) if out else None
        if last and float(window(each).ends[0]) <= float(last.ends[1]):
            out[-1].append(each)
        else:
            out.append([each])
    return out


def _stop(part: Iterable[Window]) -> float:
    return max(window.reach[1] for window in part)


def _at_worst(windows: Sequence[Window]) -> str:
    """The most severe of what teeth bear in ranges, with the largest force."""
    borne = [each for each in windows if math.isfinite(each.dynamic_factor)]
    if not borne:
        return BEYOND
    worst, largest = max(borne, key=_severity), max(borne, key=lambda each: each.dynamic_factor)
    return f"at worst {worst.cause}, largest factor {measured(largest.dynamic_factor, 3)} at {largest.largest_at} rpm"


def _severity(window: Window) -> tuple[int, float]:
    """The order of ranges to avoid by what happens there, then by the factor, 0 where teeth bear none."""
    return SEVERITIES.index(window.severity), float(np.nan_to_num(window.dynamic_factor))


def _usable(found: Assessment) -> list[str]:
    """What is usable at all torques, in operation and also after a load change."""
    out, after = [], "from wide states" if found.at[0].wide else "after a load change"
    for name, share, parts in (("in operation", found.usable_share_in_operation, found.usable_in_operation),
                               (f"also {after}", found.usable_share, found.usable_at_all)):
        ranges = usable_in_words(parts, found.speeds)
        more = len(ranges) - _MOST_NAMED
        narrower = f" and {more} narrower range{'s' * (more > 1)}" if more > 0 else ""
        at_all = "at all torques " * (len(found.at) > 1)
        out.append(f"usable {at_all}{name}: {100 * share:.1f} % of {_scanned(found)}"
                   + f": {', '.join(ranges[:_MOST_NAMED])}{narrower}" * bool(ranges))
    if not any(each.load_change for each in found.at):
        return out[:1]
    first, _, same = out[0].partition(":")
    return [f"{first} and also {after}:{same}"] if out[1].endswith(f":{same}") else out


def worst(found: Assessment) -> str:
    """The largest dynamic factor that teeth bear, with its root stress."""
    part, at = max(((each.largest, each) for each in found.at), key=lambda pair: np.nan_to_num(
        pair[0].dynamic_factor, nan=-1.0))
    if math.isnan(part.dynamic_factor):
        return f"all motions found are {BEYOND}"
    there = at.dataset.sel(speed=part.speed_of_largest)
    there = there.isel(motion=there["dynamic_factor"].values == part.dynamic_factor)
    meaning = ", where the teeth hit both flanks" * int(there["contact"].values.max() == 2)
    motions = there["motion"].values.tolist()
    after = "" if set(motions) & set(OPERATION) else f" ({MOTIONS[motions[0]]})"
    if MESH in there.dims:
        after += f" in {there[MESH].values[int(there['mesh_dynamic_factor'].max('motion').argmax(MESH))]}"
    root = root_in_words(found.gears, at.torque, part.dynamic_factor)
    # the largest root stress where it is at another torque than the largest dynamic factor
    peaks = [(peak_root_stress(found.gears, each.torque, each.largest.dynamic_factor), each) for each in found.at]
    stress, there_at = max(((max(peak), each) for peak, each in peaks if peak is not None),
                           key=lambda pair: pair[0], default=(0.0, at))
    elsewhere = "" if there_at.torque == at.torque else (
        f"; the largest root stress {measured(stress, 3)} {ROOT_STRESS.unit}, at {there_at.largest.largest_at} rpm and "
        f"{there_at.torque:.6g} N m")
    return (f"the largest dynamic factor{after} is {measured(part.dynamic_factor, 3)}{root}, at "
            f"{part.largest_at} rpm and {at.torque:.6g} N m{meaning}{elsewhere}")


def knocks_in_words(at: SpeedsToAvoid) -> list[str]:
    """The least knocks that lead from a good motion to one to avoid, in sentences."""
    return [f"about {range_in_words(knock.start, knock.stop)} rpm: a knock leads to a motion to avoid, the least at "
            f"{speed_in_words(knock.speed, 0)} rpm is {measured(abs(knock.speed_step), 2)} rpm of wheel 1 "
            f"({measured(abs(knock.impulse), 2)} N m s), to "
            f"{f'what is {BEYOND}' if knock.beyond_the_teeth else f'a factor of {measured(knock.dynamic_factor, 3)}'}"
            for knock in at.knocks]


def keep_out(found: Assessment, most: int = _MOST_KEPT_OUT) -> list[str]:
    """The ranges to avoid with what happens there and from how many random states, rounded outwards.

    Where there are more than so many, those that overlap, also at different torques, are merged, and the widest named.
    """
    merged = [[pair] for pair in found.avoid]
    if len(merged) > most:
        merged = _merged(found.avoid, lambda pair: pair[1])
    widest = sorted(merged, key=lambda part: max(window.reach[1] for _, window in part) - part[0][1].reach[0])[-most:]
    more = len(merged) - len(widest)
    out = []
    for part in (each for each in merged if each in widest):
        first, last = part[0][1], max((window for _, window in part), key=lambda each: each.reach[1])
        where, torques = f"{edges(first)[0]} to {edges(last)[1]} rpm", _torques(sorted({torque for torque, _ in part}))
        if len(part) == 1:
            out.append(f"{where} at {torques}: {first.cause}, {likelihood(first)}")
            continue
        torque, worst = max(part, key=lambda pair: _severity(pair[1]))
        states = [window.random_states for _, window in part if window.random_states]
        shares = [each.fraction for each in states]
        ends = list(dict.fromkeys(map(_percent, (min(shares), max(shares))))) if shares else []
        out.append(f"{where}, {len(part)} ranges at {torques} merged: at worst {worst.cause} at {torque:.6g} N m" + (
            f"; from {' to '.join(ends)} % of {_STATES[states[0].motion]}, by range and torque" if ends else ""))
    return out + [f"{more} narrower range{'s' * (more > 1)}, in the tables"] * bool(more)


def likelihood(window: Window) -> str:
    """How a range's motion to avoid is met, and after which share of load changes, with its 95 % interval."""
    found = window.random_states
    if found is None:
        return f"met: {met_in_words(window)}"
    behind = f"{found.states} at {found.speeds} speed{'s' * (found.speeds > 1)}"
    if found.fraction == 1:
        return f"met: {met_in_words(window)}; after all {_STATES[found.motion]} tried, {behind}"
    return (f"met: {met_in_words(window)}; after {_percent(found.fraction)} % of {_STATES[found.motion]} (95 %: "
            f"{_interval(found)} %), {behind}")


def met_in_words(window: Window) -> str:
    """How operation comes to a motion to avoid: always, or by which history."""
    if not window.operation:
        return window.reached[-1].motion
    if not window.depends_on_history:
        return "always"
    names = {MOTIONS["rest"]: "rest", MOTIONS["rising"]: "rising", MOTIONS["falling"]: "falling"}
    histories = [names[each.motion] for each in window.reached if each.motion in names]
    by_others = any(each.motion == MOTIONS["changing"] for each in window.reached)
    return "by history" if by_others or len(histories) == len(names) else ", ".join(histories)


def _percent(share: float) -> str:
    """A share in percent; 0 and 100 are none and all."""
    if 0 < share < 0.01:
        return f"{100 * share:.1g}"
    return f"{100 if share == 1 else min(round(100 * share), 99)}"


def _interval(found: RandomStates) -> str:
    """The interval of a share in percent, rounded outwards."""
    return f"{math.floor(100 * found.fraction_lo)}–{math.ceil(100 * found.fraction_hi)}"


def rows(at: SpeedsToAvoid, gears: Any, every: bool = True) -> list[Row]:
    """The ranges to avoid at a torque, rounded outwards; those that are minor only with ``every``."""
    out = []
    for window in at.windows:
        if every or not window.minor:
            shares, factor = window.random_states, window.dynamic_factor
            root, known = peak_root_stress(gears, at.torque, factor), math.isfinite(factor)
            out.append(Row(
                *edges(window), window.cause, met_in_words(window), measured(factor, 3) if known else "–",
                window.largest_at if known else "–", "–" if root is None else measured(max(root), 3),
                "–" if shares is None else f"{_percent(shares.fraction)} ({_interval(shares)})",
                _event(window.begins_with, window.start_resolution, window.from_scan_start),
                _event(window.ends_with, window.stop_resolution, window.to_scan_end)))
    return out


def avoided(at: SpeedsToAvoid, gears: Any, every: bool = True) -> Section:
    """The ranges to avoid at a torque, minor ones as rows only with ``every``, what is beyond the teeth, and knocks."""
    found = rows(at, gears, every)
    heading = ", ".join(filter(None, [
        f"At {at.torque:.6g} N m", at_no_speed(at), f"avoid{' nothing' * (not at.windows)}"]))
    return Section(heading, [headings(at), *found] if found else [], [*filter(None, [
        "" if every else _minor_in_words(at), beyond_in_words(at)]), *knocks_in_words(at)])


def beyond_in_words(at: SpeedsToAvoid) -> str:
    """The ranges in which some motions are beyond the teeth; empty if there are none."""
    named = ", ".join(" to ".join(edges(each)) for each in at.windows if each.beyond_the_teeth)
    return f"{BEYOND}, and without a factor, are some motions in {named} rpm: {at.teeth_bear}" if named else ""


def _minor_in_words(at: SpeedsToAvoid) -> str:
    """The minor ranges in a sentence; empty if there are none."""
    minor = [window for window in at.windows if window.minor]
    if not minor:
        return ""
    named = ", ".join(f"{' to '.join(edges(each))}{_rarely([each])}" for each in minor[:_MOST_RANGES])
    states = _STATES[MOTIONS["other" if at.wide else "load change"]]
    kinds = [words for words, some in ((f"narrower than {100 * FEW:g} %", any(each.narrow for each in minor)), (
        f"after fewer than {100 * FEW:g} % of {states}", any(each.rare for each in minor))) if some]
    lead = "and " * (len(minor) < len(at.windows))
    return (f"{lead}{len(minor)} range{'s' * (len(minor) > 1)} {listed(kinds, 'or')}: {named}"
            f"{', …' * (len(minor) > _MOST_RANGES)} rpm")


def tried_in_words(found: Assessment) -> str:
    """What an answer rests on first of all."""
    return f"tried: {found.tried}; a motion that few states lead to can be missed"


def at_no_speed(at: SpeedsToAvoid) -> str:
    """The dynamic factor that the jumps of the stiffness make at any speed; empty where it is 1, or not known."""
    ratio = ratio_in_words(at.quasi_static_ratio)
    return f"dynamic factor {ratio} at speed 0" if ratio else ""


def _event(kind: str, resolution: float, scan_end: bool) -> str:
    """The event at an edge, and how well it is known; a dash where a motion that does not repeat ends."""
    if scan_end:
        return "end of scan"
    return (kind or "–") + (f" ±{measured(resolution, 2)}" if resolution else "")


def jumps(found: Assessment) -> list[str]:
    """The jumps of slow run-ups and run-downs, each in words."""
    sweeps = {"up": "run-up", "down": "run-down"}
    return [f"{sweeps[jump.direction]} at {each.torque:.6g} N m: {jump.speed:.0f} rpm, {jump.event or 'no event'}, "
            f"dynamic factor {measured(jump.factor_before, 3)} to {measured(jump.factor_after, 3)}"
            for each in found.at for jump in each.jumps]


def title(gears: Any) -> str:
    """What was assessed."""
    if is_design(gears):
        return pair_title(gears)
    if hasattr(gears, "meshes"):
        return f"Gear train, {len(gears.bodies)} bodies, {len(gears.meshes)} meshes"
    return f"Gear pair {gears.n1}/{gears.n2}"
