"""The speeds to avoid: where the teeth separate, in any of the motions that are found, and how high the force is."""

from __future__ import annotations

from dataclasses import asdict, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.continuation.natural import PathEnd
from gearchaos.datasets import new_dataset, provenance, variable, variables
from gearchaos.dynamics import Classification
from gearchaos.dynamics.response import MESH
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.io.units import measured
from gearchaos.gears.operation.operating import as_model, gears_of, is_design
from gearchaos.studies.core.axis import Axis
from gearchaos.studies.core.operating_ranges import range_of_speeds
from gearchaos.studies.core.price import announce
from gearchaos.studies.core.study import mesh_coordinate
from gearchaos.studies.operation.beyond_the_teeth import BEYOND
from gearchaos.studies.operation.followed_motions import (
    MOST_SEVERE,
    MOST_SPEEDS,
    OTHER,
    RESOLUTION,
    runs,
    step_at_resonance,
)
from gearchaos.studies.operation.load_change import REVERSAL
from gearchaos.studies.operation.severities import CONTACT_WORDS
from gearchaos.studies.speeds.criteria import CRITERIA, SPACING, STARTS, Criteria
from gearchaos.studies.speeds.speed_and_torque import by_standards, with_torque
from gearchaos.studies.speeds.speed_search import AtTorque, SpeedSearch, criterion_of
from gearchaos.studies.speeds.speed_windows import (
    MOST_PEAKS,
    MOTIONS,
    OPERATION,
    Peak,
    RandomStates,
    Reached,
    SpeedsToAvoid,
    Window,
    largest_factors,
    speed_range,
    weights_of,
)

if TYPE_CHECKING:
    import xarray as xr


def speeds_to_avoid(
    design: GearDesign, speed: Axis | str, torque: Any = None, *, factor: float | None = None,
    root_stress: float | str | None = None, separation: bool = True,
    starts: int = STARTS, spacing: float = SPACING, seed: int = 0, load_change: float | None = REVERSAL.ratio,
    wide: bool = False, knocks: bool = True, settings: Classification | None = None, progress: bool = False,
    threads: int | None = None,
) -> SpeedsToAvoid:
    """The ranges of speed in which the teeth separate, or the dynamic factor is too high, in any motion that a gearbox
    can meet: in operation, or after a change of the load.

    Parameters
    ----------
    design : GearDesign
        The gear pair, with all that a model needs but the speed.
    speed : Axis or str
        The range of speeds of wheel 1 in rpm: "600:9000", or with a number of first speeds "600:9000:60", or an `Axis`
        with the name "speed". Speeds are added between them.
    torque : torque, optional
        At wheel 1, a number in N m or a text such as "300 N*m"; by default that of the design.
    factor : float, optional
        Also the ranges in which the dynamic factor over the quasi-static ratio exceeds this although the teeth stay in
        contact.
    root_stress : float or str, optional
        Likewise those in which the nominal root stress at the peak of the whole mesh force exceeds this, in N/mm² or
        with a unit.
    separation : bool, optional
        False for the ranges in which that ratio exceeds ``factor`` alone, whether the teeth separate or not; a motion
        that diverges exceeds every factor.
    starts : int, optional
        States after a change of the load at each speed; an eighth of them where a motion to avoid is known, and an
        eighth of that where one does not repeat, but in each range to avoid no fewer than 64, or than these.
    spacing : float, optional
        Largest distance of these speeds next to one where no motion to avoid is known, as a share of the speed.
    seed : int, optional
        Of these states.
    load_change : float or None
        λ: the load goes away or reverses to −λ times itself, for any time, and comes back: 1 is a reversal, 0 a loss,
        −0.5 a fall to half of it. None where the load never changes: then operation alone is looked at.
    wide : bool
        Draw from the ranges that `gearchaos.attractors` takes by default instead, which hold states that no load
        stores.
    knocks : bool
        Also look for the least knocks that lead from the motion from rest to one to avoid, at speeds without one.
    settings, progress, threads
        As in `zones`.

    Returns
    -------
    SpeedsToAvoid

    Raises
    ------
    InputError
        If an input that the model needs is missing, the torque is 0, the axis is wrong, a number is out of bounds, or
        there is no factor without separation.

    Examples
    --------
    >>> import gearchaos as gc
    >>> design = gc.GearDesign(
    ...     teeth=(50, 50), module="3 mm", face_width="20 mm", bore="30 mm", damping_ratio=0.05,
    ...     backlash={"value": "0.12 mm", "of": "line of action, total"}, transmission_error="from quality (typical)",
    ...     quality={"standard": "ISO 1328-1:1995", "grade": 6})
    >>> found = gc.speeds_to_avoid(design, "800:1250:10", "100 N*m", starts=64)
    >>> [each.words for each in found.windows]
    ['860 to 941 rpm', '1057 to 1164 rpm', '1201 to 1250 rpm']
    >>> [each.motion for each in found.windows[-1].reached], found.windows[-1].to_scan_end
    (['load change'], True)
    """
    axis = range_of_speeds(speed)
    at_start = with_torque(design, torque).at(speed=axis.start)
    criteria = Criteria.checked(
        starts, spacing, seed, settings, factor=factor, root_stress=root_stress, separation=separation,
        load_change=load_change, wide=wide, knocks=knocks)
    model = as_model(at_start)
    search = SpeedSearch(model, axis, [model.value("torque")], criteria)
    announce(search, progress, threads)
    (found,) = search.run(progress=progress, threads=threads)
    result = summarised(found)
    return replace(result, dataset=result.dataset.assign(by_standards(at_start, np.array(found.motions.speeds))))


def summarised(found: AtTorque) -> SpeedsToAvoid:
    """What was found at a torque."""
    motions, criteria, model = found.motions, found.criteria, found.motions.model
    gears, torque = gears_of(model), (model.value("torque") or 0.0) if motions.torque is None else motions.torque
    dataset = _dataset(found).assign(
        quasi_static_ratio=variable("quasi_static_ratio", (), np.array(found.ratio)),
    ).assign_coords(torque=variable("torque", (), np.array(torque))).assign_attrs(provenance(
        "speeds_to_avoid", model, starts=criteria.starts, spacing=criteria.spacing, seed=criteria.seed,
        classification=asdict(criteria.settings)))
    windows = _windows(found, dataset)
    if model.mesh_names:
        factors = np.array([[m.factors if m and m.factors else [np.nan] * len(model.mesh_names) for m in row]
                            for row in motions.named().values()])
        dataset = dataset.assign(mesh_dynamic_factor=variable(
            "mesh_dynamic_factor", ("motion", "speed", MESH), factors)).assign_coords(mesh_coordinate(model))
    coarse = [f"the search ended at {MOST_SPEEDS} speeds"] * (len(motions.speeds) >= MOST_SPEEDS)
    if step_at_resonance(model, motions.speeds[-1]) < RESOLUTION:
        coarse.append(f"at {model.least_damping_in_words} a resonance may pass between the first speeds")
    return SpeedsToAvoid(
        float(torque), windows, criteria.words(found.ratio), found.ratio, dataset, _tried(found), RESOLUTION,
        "; ".join(coarse), gears.error_harmonics.source if is_design(gears) else "as given", found.limits.words,
        criteria.change_in_words, found.jumps, found.knocks)


def _tried(found: AtTorque) -> str:
    """From which initial states motions were looked for, with the least and the largest number of random ones."""
    drawn = [len(each) for each in found.motions.drawn.values()]
    words = f"from rest, sweeps at {len(found.motions.speeds)} speeds"
    size = f"{measured(found.largest_knock, 3)} rpm of the speed of wheel 1"
    knocks = f", knocks of up to {size}" * (found.largest_knock > 0)
    if not drawn:
        return words + knocks
    number = " to ".join(map(str, sorted({min(drawn), max(drawn)})))
    states = f"state{'s' * (max(drawn) > 1)}"
    criteria, change = found.criteria, found.criteria.load_change
    after = f"after {change.words} " if change and not criteria.wide else ""
    return f"{words}, {number} {'' if after else 'random '}{states} {after}at {len(drawn)}{knocks}"


def _dataset(found: AtTorque) -> xr.Dataset:
    """The motions over the motion and the speed, and over the speed the random states."""
    motions, rows = found.motions, found.motions.named()
    rows[found.criteria.others] = rows.pop(OTHER)
    data = {name: np.array([[none if m is None else getattr(m, name) for m in row] for row in rows.values()],
                           dtype=dtype)
            for name, none, dtype in (("label", 0, np.int32), ("period", 0, np.int32), ("contact", -1, np.int32),
                                      ("dynamic_factor", np.nan, float))}
    beyond = np.array([[m is not None and found.beyond(m) for m in row] for row in rows.values()])
    data |= {"beyond_the_teeth": beyond, "dynamic_factor": np.where(beyond, np.nan, data["dynamic_factor"])}
    drawn = [motions.drawn.get(speed, []) for speed in motions.speeds]
    avoided = {id(m) for s in motions.speeds for m in motions.at[s] if found.criterion(m)}
    states = {"random_states": np.array([len(each) for each in drawn]),
              "avoided_states": np.array([sum(id(m) in avoided for m in each) for each in drawn])}
    return new_dataset(variables(("motion", "speed"), data) | variables(("speed",), states), {
        "speed": variable("speed", ("speed",), np.array(motions.speeds)), "motion": list(rows)})


def _windows(found: AtTorque, dataset: xr.Dataset) -> tuple[Window, ...]:
    """The ranges of speed that are equally to be avoided, in operation or after a load change alone."""
    motions, criterion = found.motions, found.criterion
    speeds, met = dataset["speed"].values, motions.operation()
    criteria = np.array([[0 if m is None else criterion(m) for m in row] for row in motions.named().values()])
    ranks, windows = motions.ranks(criterion), []
    parts = runs(ranks)
    ends = [PathEnd(float(speeds[0])), *found.edges, PathEnd(float(speeds[-1]))]
    for part, (start, stop) in zip(parts, pairwise(ends), strict=True):
        first, last = part[0], part[-1]
        before, rank, after = ([0, *ranks, 0][i] for i in (first, first + 1, last + 2))
        if not rank:
            continue
        operation, own = rank > MOST_SEVERE, criterion_of(rank)
        whole = dataset.isel(speed=slice(first, last + 1))
        within = whole.isel(motion=slice(len(OPERATION)) if operation else slice(len(OPERATION), None))
        known = largest_factors(dataset.isel(motion=slice(len(OPERATION)) if operation else slice(None)))
        inner = range(max(first, 1), min(last, len(known) - 2) + 1)
        peaks = [i for i in inner if known[i - 1] < known[i] >= known[i + 1]]
        largest = sorted(sorted(peaks, key=lambda i: -known[i])[:MOST_PEAKS])
        weights, speeds_within = weights_of(whole), speeds[first : last + 1].tolist()
        free = [i for i in range(last + 1 - first) if operation and any(criterion(m) < own for m in met[first + i])]
        history = (start.value if free[0] == 0 else speeds_within[free[0] - 1],
                   stop.value if free[-1] == last - first else speeds_within[free[-1] + 1]) if free else None
        rows = zip(dataset["motion"].values.tolist(), criteria[:, first : last + 1] > 0,
                   whole["dynamic_factor"].values, strict=True)
        reached = [Reached(MOTIONS[name], float(weights[avoided].sum() / weights.sum()), float(factors[avoided].max()))
                   for name, avoided, factors in rows if avoided.any()]
        own_range, beyond = speed_range(within), within["beyond_the_teeth"].values
        anyhow = speed_range(whole)
        worse = operation and anyhow.dynamic_factor > np.nan_to_num(own_range.dynamic_factor)
        borne = within["contact"].values[~beyond].max(initial=0)
        windows.append(Window(
            start.value, stop.value, own_range.dynamic_factor, own_range.speed_of_largest,
            start.resolution * (rank > before), stop.resolution * (rank > after), reached=tuple(reached),
            operation=operation, criterion=CRITERIA[own],
            contact=CONTACT_WORDS[borne] if np.isfinite(own_range.dynamic_factor) else BEYOND,
            beyond_the_teeth=bool(whole["beyond_the_teeth"].values.any()), hits=found.hits(own_range.dynamic_factor),
            from_scan_start=first == 0, to_scan_end=last == len(speeds) - 1, begins_with=start.kind,
            ends_with=stop.kind, meshes=found.meshes(first, last, own), history=history,
            random_states=RandomStates.of(whole),
            peaks=tuple(Peak(float(speeds[i]), float(known[i])) for i in largest),
            largest_after_load_change=Peak(anyhow.speed_of_largest, anyhow.dynamic_factor) if worse else None))
    return tuple(windows)
