"""A result of each study in both kinds of units, the pictures of each, and whether a figure cuts what it draws."""

from functools import cache

import xarray as xr
from matplotlib.figure import Figure

import gearchaos as gc
from gearchaos import plot
from tests.branches import PAIR

SCALES = PAIR.scales
LENGTH, VELOCITY, FORCE = SCALES.length * 1e6, SCALES.velocity * 1e3, SCALES.force
SINGLE = gc.MeshModel.of(kind="single", omega=0.8, eps1=0.1)

STUDIES = {
    "simulate": lambda model: gc.simulate(model, 24, 40, samples=32),
    "section": lambda model: gc.simulate(model, 24, 40),
    "zones": lambda model: gc.zones(model, "omega=0.3:1.5:12", "eps1=0:0.3:9", starts=2),
    "torques": lambda model: gc.zones(model, "omega=0.3:1.5:4", "q0=0.02:0.2:3", starts=2),
    "bifurcation": lambda model: gc.bifurcation(model, "eps1=0:0.3:12", points=16),
    "basins": lambda _: gc.basins(SINGLE, "z=-3:3:8", "z_dot=-2:2:8"),
    "attractors": lambda _: gc.attractors(SINGLE, 16), "branch": lambda model: gc.branch(model, "eps1=0.09:0.3")}


@cache
def result(name: str) -> tuple[xr.Dataset, xr.Dataset]:
    """The result of a study without dimensions and in physical units, which no test changes."""
    found = STUDIES[name](PAIR.to_model())
    return found, gc.physical(found, PAIR)


# picture -> (result, how to draw it, the physical unit along x and along y, and of the colours)
PICTURES = {
    "history": ("simulate", lambda ds, ax: plot.history(ds, "z_dot", ax), 1, VELOCITY, 1),
    "history of the force": ("simulate", lambda ds, ax: plot.history(ds, "mesh_force", ax, periods=6), 1, FORCE, 1),
    "spectrum": ("simulate", lambda ds, ax: plot.spectrum(ds, "z", ax), 1, LENGTH, 1),
    "phase": ("simulate", lambda ds, ax: plot.phase(ds, "z", ax=ax), LENGTH, VELOCITY, 1),
    "phase with z upwards": ("simulate", lambda ds, ax: plot.phase(ds, "z_dot", "z", ax), VELOCITY, LENGTH, 1),
    "portrait": ("simulate", lambda ds, ax: plot.portrait(ds, "z", ax=ax), LENGTH, VELOCITY, 1),
    "portrait without samples": ("section", lambda ds, ax: plot.portrait(ds, "x1", ax=ax), LENGTH, VELOCITY, 1),
    "zones": ("zones", lambda ds, ax: plot.zones(ds, ax), SCALES.frequency, LENGTH, 1),
    "zones over torques": ("torques", lambda ds, ax: plot.zones(ds, ax), SCALES.frequency, SCALES.torque1, 1),
    "bifurcation": ("bifurcation", lambda ds, ax: plot.bifurcation(ds, "x1", ax), LENGTH, LENGTH, 1),
    "response": ("bifurcation", lambda ds, ax: plot.response(ds, "v_rms", ax), LENGTH, VELOCITY, 1),
    "contact along": ("bifurcation", lambda ds, ax: plot.response(ds, "contact", ax), LENGTH, 1, 1),
    "lyapunov": ("bifurcation", lambda ds, ax: plot.lyapunov(ds, ax), LENGTH, SCALES.rate, 1),
    "basins": ("basins", lambda ds, ax: plot.basins(ds, ax), LENGTH, VELOCITY, 1),
    "attractors": ("attractors", lambda ds, ax: plot.attractors(ds, ax), LENGTH, VELOCITY, 1),
    "response_curve": ("branch", lambda ds, ax: plot.response_curve(ds, ax=ax), LENGTH, LENGTH, 1),
    "branch": ("branch", lambda ds, ax: plot.branch(ds, "x1_dot", ax), LENGTH, VELOCITY, 1),
} | {name: ("zones", lambda ds, ax, name=name: plot.level(ds, name, ax), SCALES.frequency, LENGTH, unit)
     for name, unit in {"v_rms": VELOCITY, "v_rms_up": VELOCITY, "v_rms_most": VELOCITY, "dynamic_factor": 1,
                        "contact": 1, "hysteresis": 1, "reason": 1, "period": 1}.items()}


def cut(figure: Figure) -> list[str]:
    """The sides of a figure over which something it draws reaches, by more than a pixel."""
    figure.draw_without_rendering()
    drawn, (width, height), pixel = figure.get_tightbbox(), figure.get_size_inches(), 1 / figure.dpi
    over = {"left": -drawn.x0, "right": drawn.x1 - width, "below": -drawn.y0, "above": drawn.y1 - height}
    return [side for side, inches in over.items() if inches > pixel]
