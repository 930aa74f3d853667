"""A train as a scheme of its bodies, shafts and meshes, and the flanks that touch along a motion."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import xarray as xr
from matplotlib import rcParams
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.patches import Annulus, Circle, FancyArrowPatch, Patch

from gearchaos.errors import InputError
from gearchaos.gears.train.mesh import Mesh
from gearchaos.gears.train.parts import GROUND, Body
from gearchaos.gears.train.train import Train
from gearchaos.plot._datasets import check, keeps_data
from gearchaos.plot.axes import axis_label, draw_legend, new_axes
from gearchaos.plot.theme import BACKGROUND, INK, STROBE, adapt

_STEEL, _SHADE = "#e8ecf4", "#cfd7e6"  # of wheels, and of the smaller of two wheels on one body
_GAP, _PLAIN = 0.35, 0.7  # free length of a shaft, and radius of a body without teeth, over the mean radius of wheels
_DIRECTIONS = (0, -90, 90, -45, 45, 180, -135, 135)  # of the next body, degrees
_APART = 0.12  # least distance of circles that do not touch, over the mean radius of wheels
_EVEN = 0.5  # power of the radii by which circles grow where there are no planets
_FLAT = 1.3  # how much more a picture should be wide than high
RIM = 0.07  # thickness of a ring over its radius
_MARGIN = 0.05
_LINE_HEIGHT, _CHARACTER = 1.2, 0.55  # height and mean width of text over the size of the font
_SMALLEST = 4.5  # size of the font in points of what is written into a wheel
_FLANKS = ((-1, "#d18f00", "back flanks"), (0, "#f2f2f2", "apart"), (1, INK, "front flanks"))


class Scheme:
    """Where the bodies of a train are drawn: wheels that mesh touch, those on a shaft stand beside each other."""

    def __init__(self, train: Train) -> None:
        self.train = train
        self.unit = float(np.mean([mesh.base_radii for mesh in train.meshes]))
        self.radii: dict[str, list[float]] = {body.name: [] for body in train.bodies}
        for mesh in train.meshes:
            for name, radius in zip(mesh.between, self.of_mesh(mesh), strict=True):
                if not any(math.isclose(radius, other, rel_tol=1e-6) for other in self.radii[name]):
                    self.radii[name].append(radius)
        self.centres: dict[str, tuple[float, float]] = {}
        self.common = {name: body.carrier for body in train.bodies if body.carrier for name in (  # on whose axis it is
            body.carrier, *(name for mesh in train.meshes if body.name in mesh.between for name in mesh.between
                            if train.body(name).carrier is None))}
        self._place(train.bodies[0].name, (0.0, 0.0))
        shafts = [(None, shaft.between) for shaft in train.shafts if GROUND not in shaft.between]
        links: list[tuple[Mesh | None, tuple[str, str]]] = [*((mesh, mesh.between) for mesh in train.meshes), *shafts]
        while left := [link for link in links if len({name in self.centres for name in link[1]}) == 2]:
            self._attach(*left[0])

    def of_mesh(self, mesh: Mesh) -> tuple[float, float]:
        """Radii of the circles of its wheels."""
        power = 1.0 if any(body.carrier for body in self.train.bodies) else _EVEN
        a, b = ((radius / self.unit) ** power * self.unit for radius in mesh.base_radii)
        return a, b

    def radius(self, name: str) -> float:
        """Of the largest wheel of a body."""
        return max(self.radii[name], default=_PLAIN * self.unit)

    def reach(self, name: str) -> float:
        """Radius at which a shaft is fixed to a body."""
        return next((self.orbit(body) for body in self.train.bodies if body.carrier == name), self.radius(name))

    def _place(self, name: str, centre: tuple[float, float]) -> None:
        """Place a body, with all that is on the axis of its carrier, and the planets."""
        self.centres[name] = centre
        carrier = self.common.get(name)
        for other in [n for n, own in self.common.items() if own == carrier and carrier]:
            self.centres[other] = centre
        for body in self.train.bodies:
            if carrier and body.carrier == carrier:
                self.centres[body.name] = (centre[0] + self.orbit(body) * math.cos(body.position),
                                           centre[1] + self.orbit(body) * math.sin(body.position))

    def orbit(self, planet: Body) -> float:
        """With which the base circles of a planet touch those that they meet."""
        mesh = next((mesh for mesh in self.train.meshes if planet.name in mesh.between), None)
        return planet.orbit if mesh is None else self._distance(mesh)

    def _distance(self, mesh: Mesh) -> float:
        a, b = self.of_mesh(mesh)
        return abs(a - b) if mesh.internal else a + b

    def _attach(self, mesh: Mesh | None, between: tuple[str, str]) -> None:
        """Place the body at the other end of a mesh or shaft where nothing is and the picture becomes the smallest."""
        known, name = between if between[0] in self.centres else between[::-1]
        distance = self._distance(mesh) if mesh else self.extent(known) + _GAP * self.unit + self.extent(name)
        x, y = self.centres[known]
        places = [(x + distance * math.cos(math.radians(angle)), y + distance * math.sin(math.radians(angle)))
                  for angle in _DIRECTIONS]
        inside, radius, beside = mesh is not None and mesh.internal, self.extent(name), self.on_axis(known)
        free = [place for place in places if inside or all(
            math.dist(place, centre) > radius + self.extent(other) + _APART * self.unit
            for other, centre in self.centres.items() if other not in beside)]

        def size(place: tuple[float, float]) -> float:
            low, high = self.limits((place, radius))
            return round(max(high[0] - low[0], _FLAT * (high[1] - low[1])), 9)

        self._place(name, min(free or places, key=size))

    def on_axis(self, name: str) -> list[str]:
        """The body and those on the axis of the carrier that is on its axis."""
        carrier = self.common.get(name)
        return [name, *(n for n, own in self.common.items() if own == carrier and n != name and carrier)]

    def extent(self, name: str) -> float:
        """Radius of what is drawn around the centre of a body."""
        planets = [self.orbit(body) + self.radius(body.name) for body in self.train.bodies
                   if body.carrier and body.carrier == self.common.get(name)]
        return max([*planets, *map(self.radius, self.on_axis(name))])

    def limits(self, *more: tuple[tuple[float, float], float]) -> tuple[np.ndarray, np.ndarray]:
        """The lower left and the upper right corner of all circles."""
        circles = [*((centre, self.extent(name)) for name, centre in self.centres.items()), *more]
        low, high = (np.array([[centre[i] + sign * r for i in (0, 1)] for centre, r in circles]) for sign in (-1, 1))
        return low.min(axis=0), high.max(axis=0)

    def ring(self, name: str) -> bool:
        """Whether a body has inner teeth."""
        return any(mesh.internal and name == mesh.between[int(mesh.teeth[1] > mesh.teeth[0])]
                   for mesh in self.train.meshes)

    def teeth(self, name: str) -> str:
        """The numbers of teeth of the wheels of a body, as they are written."""
        found = {z: None for mesh in self.train.meshes for n, z in zip(mesh.between, mesh.teeth, strict=True)
                 if n == name}
        return "z " + " / ".join(map(str, found)) if found else ""


def train(train: Train, ax: Axes | None = None) -> Axes:
    """Draw a train as a scheme: wheels with names, teeth, speeds and sense of rotation, shafts and meshes.

    Wheels that mesh touch, bodies on one shaft stand beside each other with a double line between them, and planets
    stand on the circle of their carrier. With planets circles are to scale, otherwise small wheels are drawn larger, so
    that they can be read. Where a loop does not close in the plane, a dotted line is the mesh. A broken edge is a
    prescribed motion, hatching a body that is held. Names of shafts, and of meshes without
    planets, are written where they were given.

    Parameters
    ----------
    train : Train
    ax : Axes, optional
        Where to draw; a new figure if left out.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        For anything but a `Train`.

    Examples
    --------
    >>> import gearchaos as gc
    >>> bodies = [gc.Body(name="a", inertia=1e-3), gc.Body(name="b", inertia=2e-3)]
    >>> ax = gc.plot.train(gc.Train(speed="6000 rpm", bodies=bodies, meshes=[gc.Mesh(
    ...     between=("a", "b"), teeth=(20, 30), base_radii=("30 mm", "45 mm"), stiffness="2e8 N/m",
    ...     backlash="0.1 mm")]))
    >>> [text.get_text() for text in ax.texts][0].split()
    ['b', 'z', '30', '4000', 'rpm']
    """
    if not isinstance(train, Train):
        raise InputError("train", "must be a Train", f"a {type(train).__name__}")
    ax, scheme = new_axes(ax), Scheme(train)
    ax.set_axis_off()
    ax.set_aspect("equal")
    low, high = scheme.limits()
    margin = _MARGIN * (high - low).max()
    ax.set(xlim=(low[0] - margin, high[0] + margin), ylim=(low[1] - margin, high[1] + margin))
    ax.apply_aspect()
    scale = ax.get_window_extent().width / (ax.get_xlim()[1] - ax.get_xlim()[0]) * 72 / ax.figure.dpi  # points for a m
    for body in sorted(train.bodies, key=lambda body: -scheme.radius(body.name)):
        _draw_body(ax, scheme, body, scale)
    for shaft in train.shafts:
        if GROUND not in shaft.between:
            one, other, along = _towards(scheme, *shaft.between)
            start, end = one + along * scheme.reach(shaft.between[0]), other - along * scheme.reach(shaft.between[1])
            across = np.array([-along[1], along[0]]) * 0.06 * scheme.unit
            for line in (across, -across):
                ax.plot(*zip(start + line, end + line, strict=True), color=adapt(INK), linewidth=1.1, zorder=0.8)
            _write_name(ax, (start + end) / 2, shaft.name if shaft.name != "-".join(shaft.between) else "", "black")
    for mesh in train.meshes:
        one, other, along = _towards(scheme, *mesh.between)
        a, b = scheme.of_mesh(mesh)
        start, end = one + along * a, other - along * b
        if mesh.internal:  # both touch on the same side
            start = end = one + along * a if a > b else one - along * a
        if np.linalg.norm(end - start) > 1e-6 * scheme.unit:
            ax.plot(*zip(start, end, strict=True), color=adapt(STROBE), linewidth=1.2, linestyle=(0, (1, 1.5)),
                    zorder=2)  # the loop does not close in the plane
        else:
            across = np.array([-along[1], along[0]]) * 0.16 * scheme.unit
            ax.plot(*zip(start - across, start + across, strict=True), color=adapt(STROBE), linewidth=2.2, zorder=3,
                    solid_capstyle="butt")
        given = mesh.name != "/".join(mesh.between) and train.carrier(mesh) is None
        _write_name(ax, (start + end) / 2, mesh.name if given else "", STROBE)
    return ax


def _draw_body(ax: Axes, scheme: Scheme, body: Body, scale: float) -> None:
    """Its wheels, or the arms of a carrier, the sense of rotation, and what is written; ``scale`` in points for a m."""
    centre, radius, ring = scheme.centres[body.name], scheme.radius(body.name), scheme.ring(body.name)
    planets = [scheme.centres[other.name] for other in scheme.train.bodies if other.carrier == body.name]
    style: dict[str, Any] = {
        "edgecolor": adapt(INK), "linewidth": 1.1, "zorder": 1.0, "hatch": "////" if body.fixed else None,
        "linestyle": (0, (4, 2)) if body.motion is not None else "-"}
    if planets:
        reach = math.dist(centre, planets[0])
        ax.add_patch(Circle(centre, reach, fill=False, edgecolor=adapt("0.7"), linewidth=4, zorder=0.6))
    elif ring:
        ax.add_patch(Annulus(centre, radius * (1 + RIM), radius * RIM, facecolor=adapt(_STEEL), **style))
    else:
        for n, own in enumerate(sorted(scheme.radii[body.name], reverse=True) or [radius]):
            ax.add_patch(Circle(centre, own, facecolor=adapt(_SHADE if n else _STEEL), **{
                **style, "linewidth": 0.5 if n else 1.1}))
    speed = scheme.train.speeds[body.name]
    turns = f"{abs(speed):{'.0f' if abs(speed) >= 1000 else '.4g'}} rpm"
    lines = [line for line in (body.name, scheme.teeth(body.name), turns if speed else "held") if line]
    if planets or ring:
        at, side = scheme.extent(body.name) * (1 + 1.6 * RIM), 1 if ring else -1
        place = centre[0] + side * at * math.sqrt(0.5), centre[1] + at * math.sqrt(0.5)
        ax.text(*place, "\n".join(lines), ha="left" if side > 0 else "right", va="bottom", fontsize=_size_beside(),
                color=adapt("black"), linespacing=1.0)
        arc = reach if planets else radius * (1 + RIM / 2)
    else:
        arc = 0.86 * radius
        wide, high = 1.4 * radius / (_CHARACTER * max(map(len, lines))), 1.15 * radius / (_LINE_HEIGHT * len(lines))
        size = scale * min(wide, high)
        inside = size >= _SMALLEST
        ax.text(centre[0], centre[1] - (0.06 * radius if inside else 1.08 * radius), "\n".join(lines), ha="center",
                va="center" if inside else "top", fontsize=min(size, rcParams["font.size"]) if inside else
                _size_beside(), color=adapt("black"), linespacing=1.0, zorder=4)
    if speed:
        first = [math.degrees(other.position) for other in scheme.train.bodies if other.carrier == body.name][:1]
        middle, turned = first[0] + 180 / len(planets) if planets else 75, -20 if speed > 0 else 20  # degrees
        ends = [(centre[0] + arc * math.cos(angle), centre[1] + arc * math.sin(angle))
                for angle in np.radians((middle + turned, middle - turned))]
        bend = math.tan(math.radians(40) / 4)  # of an arc of 40 degrees
        ax.add_patch(FancyArrowPatch(
            *ends, connectionstyle=f"arc3,rad={bend if speed > 0 else -bend}", color=adapt(STROBE), arrowstyle="-|>",
            mutation_scale=7, linewidth=1.0, shrinkA=0, shrinkB=0, zorder=3))


def _size_beside() -> float:
    return 0.8 * float(rcParams["font.size"])


def _towards(scheme: Scheme, a: str, b: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The centres of two bodies, and the direction from the first to the second."""
    one, other = (np.array(scheme.centres[name]) for name in (a, b))
    length = float(np.linalg.norm(other - one))
    return one, other, (other - one) / length if length else np.array([0.0, 1.0])


def _write_name(ax: Axes, place: np.ndarray, name: str, colour: str) -> None:
    if name:
        ax.text(place[0], place[1], name, ha="center", va="center", fontsize=_size_beside(), color=adapt(colour),
                zorder=5, bbox={"facecolor": adapt(BACKGROUND), "edgecolor": "none", "alpha": 0.85, "pad": 1.0})


@keeps_data
def flanks(ds: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw on which flanks each mesh of a train touches along a motion, a strip for each mesh.

    Contacts that are shorter than the time between samples may be missing: take more samples of short impacts.

    Parameters
    ----------
    ds : Dataset
        Of a `Train`, from `gearchaos.simulate` with samples: ``contact`` over ``tau`` and ``mesh``.
    ax : Axes, optional
        Where to draw; a new figure if left out.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If the Dataset is not such a result.

    Examples
    --------
    >>> import gearchaos as gc
    >>> driver = gc.Body(name="driver", motion=[{"order": 2, "acceleration": "300 rad/s^2"}])
    >>> loose = gc.Body(name="loose", inertia="5e-4 kg*m^2", torque="-0.05 N*m")
    >>> mesh = gc.Mesh(between=("driver", "loose"), teeth=(20, 30), base_radii=("30 mm", "45 mm"),
    ...                stiffness="2e8 N/m", damping="60 N*s/m", backlash="0.12 mm")
    >>> train = gc.Train(speed="800 rpm", bodies=[driver, loose], meshes=[mesh])
    >>> ax = gc.plot.flanks(gc.physical(gc.simulate(train, 2, transient=20, samples=256)))
    >>> ax.get_xlabel(), [text.get_text() for text in ax.get_yticklabels()]
    ('time $\\\\tau$ [ms]', ['driver/loose'])
    """
    check(ds, "simulate of a train with samples", contact=("tau", "mesh"))
    ax = new_axes(ax)
    time, names = ds["tau"].values, ds["mesh"].values.tolist()
    edges = np.append(time, 2 * time[-1] - time[-2] if len(time) > 1 else time[-1] + 1)
    colours = ListedColormap([adapt(colour) for _, colour, _ in _FLANKS])
    ax.pcolormesh(edges, np.arange(len(names) + 1), ds["contact"].values.T, cmap=colours,
                  norm=BoundaryNorm([-1.5, -0.5, 0.5, 1.5], 3), rasterized=True)
    ax.hlines(range(1, len(names)), edges[0], edges[-1], color=adapt(BACKGROUND), linewidth=4)
    ax.set_yticks(np.arange(len(names)) + 0.5, names)
    ax.tick_params(axis="y", length=0)
    ax.invert_yaxis()
    ax.set(xlim=(edges[0], edges[-1]), xlabel=axis_label(ds["tau"], "tau"))
    draw_legend(ax, [Patch(facecolor=adapt(colour), edgecolor=adapt("0.45"), linewidth=0.4, label=label)
                     for _, colour, label in reversed(_FLANKS)])
    return ax
