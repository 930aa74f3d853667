"""The contact pattern of a helical gear pair under its torque: line load along the path and across the face width."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from gearchaos.errors import InputError
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.plot._datasets import check_design
from gearchaos.plot.axes import new_axes
from gearchaos.plot.theme import INK, adapt

_POINTS = 400  # along the path
_MM, _PER_MM = 1e3, 1e-3


def contact_pattern(design: GearDesign, ax: Axes | None = None) -> Axes:
    """Draw the force per width between two teeth of a helical pair at rest under its torque, in N/mm.

    From left to right is the path of contact in the transverse plane, from where a tooth pair enters it, and upwards
    the common face width from its leading end. Lines show where the path begins and ends: beyond them tip corners
    touch. Where it is white the teeth never touch.

    Parameters
    ----------
    design : GearDesign
        A helical pair with a torque, whose mesh is in strips across the width.
    ax : Axes, optional
        Where to draw; a new figure if left out.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        For a design without strips.

    Examples
    --------
    >>> import gearchaos as gc
    >>> design = gc.GearDesign(teeth=(27, 35), module="3 mm", helix_angle="20 deg", face_width="25 mm",
    ...                        torque="200 N*m")
    >>> ax = gc.plot.contact_pattern(design)
    >>> ax.get_ylabel()
    'face width [mm]'
    """
    check_design(design)
    if not design.under_load:
        raise InputError("design", "must be a helical pair under a torque", design.sharing_in_words,
                         "Its mesh is in strips across the width: load_sharing = 'under load', the default.")
    strips, path = design.strips, design.geometry.contact_ratio * design.geometry.base_pitch * _MM
    load, beyond = line_loads(design)
    ax = new_axes(ax)
    drawn = ax.pcolormesh(np.linspace(-beyond, 1 + beyond, _POINTS + 1) * path,
                          np.linspace(0, strips.face_width * _MM, len(load) + 1),
                          np.ma.masked_less_equal(load * _PER_MM, 0.0), vmin=0, cmap="viridis_r", rasterized=True)
    for end in (0.0, path):
        ax.axvline(end, color=adapt(INK), linewidth=0.8, linestyle=(0, (4, 2)))
    ax.figure.colorbar(drawn, ax=ax, label="line load [N/mm]")
    ax.set(xlabel="along the path of contact [mm]", ylabel="face width [mm]")
    return ax


def line_loads(design: GearDesign) -> tuple[np.ndarray, float]:
    """Line load (strips, points), N/m, at equal steps along the path, which they exceed at both ends by a share."""
    strips, ratio = design.strips, design.geometry.contact_ratio
    found, n = strips.cycle.line_load, len(strips.cycle.deflection)
    corner = strips.pairs.corner
    beyond = 0.02 if corner is None else max(corner.length) + 0.02
    x = -beyond + (1 + 2 * beyond) * (np.arange(_POINTS) + 0.5) / _POINTS
    age, own = np.divmod(x * ratio, 1.0)  # mesh periods since the pair entered its path, and the strip's own phase
    at = np.round((own + strips.overlap * strips.across[:, None]) * n).astype(int) % n
    pair = (age - strips.first_age).astype(int)
    known = (pair >= 0) & (pair < found.shape[2])
    return np.where(known, found[at, np.arange(len(found[0]))[:, None], pair.clip(0, found.shape[2] - 1)], 0.0), beyond
