"""Cards of single motions: verdicts, orbits and what divides two basins."""

from __future__ import annotations

import numpy as np

from gearchaos.cards.card import EMPHASIS, Card, Drawing, around
from gearchaos.continuation.edge import EdgeState
from gearchaos.continuation.orbit import Orbit
from gearchaos.gears.operating import OperatingModel
from gearchaos.plot import MOTION_CLASSES
from gearchaos.studies.simulate import simulate
from gearchaos.studies.steady import steady
from gearchaos.studies.verdict import Verdict

_LONGEST = 16  # longest period, in mesh periods, of an orbit whose trajectory is drawn
_SAMPLES = 48  # instants drawn in each mesh period
_BACKLASH_COLOUR = "rgba(128,128,128,.7)"


def verdict_card(verdict: Verdict) -> Card:
    """The card of a verdict: its evidence, and the motion in the phase plane."""
    colours = {kind.name: kind.colour for kind in MOTION_CLASSES}
    rows = [("because", verdict.reason)]
    if verdict.multipliers:
        rows.append(("largest multiplier", f"{abs(verdict.multipliers[0]):.4g} in modulus"))
    if verdict.lyapunov:
        low, high = verdict.lyapunov_ci[0]
        interval = f", {low:.4g} to {high:.4g} at 99 %" if high > low else ""
        rows.append(("largest exponent", f"{verdict.lyapunov[0]:.4g}{interval}"))
    rows += [(name, f"{value:.4g}") for name, value in (
        ("V_RMS", verdict.v_rms), ("dynamic factor", verdict.dynamic_factor)) if value is not None]
    if verdict.contact is not None:
        rows.append(("contact", verdict.contact))
    model = verdict.model
    point = f"{model.kind}, ω = {model.omega:.6g}"
    if isinstance(model, OperatingModel):
        point += f", {model.value('speed'):.6g} rpm, {model.value('torque'):.6g} N m"
    rows.append(("operating point", point))
    return Card(f"Verdict: {verdict.label}", rows, _motion(verdict),
                colours.get(verdict.label, colours["other sub-harmonic"]))


def _motion(verdict: Verdict) -> str:
    """A short periodic motion as a trajectory, any other as its stroboscopic points; empty if there is none."""
    if "z" not in verdict.section:
        return ""
    points = [np.array(verdict.section[name]) for name in ("z", "z_dot")]
    if verdict.period is None or verdict.period > _LONGEST:
        return _phase_plane(None, points)
    motion = steady(verdict.model, verdict)
    samples = len(motion.tau) // 8  # `steady` records eight periods of the orbit
    return _phase_plane([motion[name].values[: samples + 1] for name in ("z", "z_dot")], points)


def _phase_plane(trajectory: list[np.ndarray] | None, points: list[np.ndarray]) -> str:
    """The plane of z and its velocity, with both ends of the backlash."""
    shown = points if trajectory is None else trajectory
    drawing = Drawing("motion in the plane of displacement and velocity", around(shown[0]), around(shown[1]))
    for end in (-1, 1):
        drawing.line(np.full(2, end), np.array(drawing.y), colour=_BACKLASH_COLOUR, width=0.8, dashed=True)
    if trajectory is not None:
        drawing.line(*trajectory)
    drawing.dots(*points, colour=EMPHASIS, radius=2.2 if trajectory is not None else 0.9)
    return drawing.svg


def orbit_card(orbit: Orbit) -> Card:
    """The card of a periodic orbit, stable or not."""
    kind = "stable" if orbit.unstable == 0 else f"unstable in {orbit.unstable} direction{'s' * (orbit.unstable > 1)}"
    rows = [("multipliers", ", ".join(_complex(m) for m in orbit.multipliers[:4])),
            ("first point", ", ".join(f"{name} = {value:.6g}" for name, value in orbit.state.items())),
            ("contact switches", str(len(orbit.switches))), ("residual", f"{orbit.residual:.2g}")]
    picture = ""
    if orbit.period <= _LONGEST:
        motion = simulate(orbit.model, orbit.period, samples=_SAMPLES)
        points = [motion[f"section_{name}"].values for name in ("z", "z_dot")]
        picture = _phase_plane([np.append(motion[n].values, motion[n].values[0]) for n in ("z", "z_dot")], points)
    return Card(f"Orbit of period {orbit.period}T, {kind}", rows, picture)


def _complex(value: complex) -> str:
    if value.imag == 0:
        return f"{value.real:.4g}"
    return f"{value.real:.4g} {'+' if value.imag > 0 else '−'} {abs(value.imag):.4g}i"


def edge_card(edge: EdgeState) -> Card:
    """The card of what divides two basins: its saddle."""
    if edge.orbit is None:
        count = len(next(iter(edge.states.values()), ()))
        return Card("Edge state: not periodic", [("states on the boundary", str(count))])
    inner = orbit_card(edge.orbit)
    return Card(f"Edge state: {inner.title[0].lower()}{inner.title[1:]}", inner.rows, inner.picture)
