"""Natural frequencies and modes of given gears, and the orders that excite them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.datasets import new_dataset, provenance, variable
from gearchaos.errors import InputError
from gearchaos.gears.io.units import RPM
from gearchaos.gears.mesh.pair import GearPair
from gearchaos.gears.operation.operating import is_design, model_of_gears
from gearchaos.gears.train.modes import contacts_in_words, modes
from gearchaos.gears.train.train import Train

if TYPE_CHECKING:
    import xarray as xr

    from gearchaos.gears.design.gear_design import GearDesign


def natural_frequencies(gears: Train | GearDesign | GearPair) -> xr.Dataset:
    """Natural frequencies and modes of gears whose meshes are all in contact, at their mean stiffnesses.

    Backlash, the variation of the stiffness and the coupling of modes by damping are left out. Stops of a shaft act
    where it has no spring beside them.

    Parameters
    ----------
    gears : Train, GearDesign or GearPair
        A pair is a train of the bodies wheel1 and wheel2. The speed of a design without one is that of its main
        resonance.

    Returns
    -------
    xarray.Dataset
        By mode, in ascending order: ``natural_frequency`` in Hz, ``damping_ratio``, and ``rigid``, whether the mode
        deflects nothing. Of unit modal mass: ``mode_angle`` of each body in its own sense of rotation, displacements
        ``mode_x`` and ``mode_y`` of its centre, and ``mode_deflection`` of each mesh, shaft and support. Where the
        energy is: ``kinetic_energy``, the share of each body, and ``strain_energy``, that of each mesh, shaft and
        support. ``order`` has those of all meshes and excitations, of the turn of the first body, whose ``speed`` is in
        rpm. The attribute ``contacts`` says which meshes and stops are taken as closed, and which as open.

    Raises
    ------
    InputError
        For anything else, or a design that lacks an input of its model.

    Examples
    --------
    >>> import gearchaos as gc
    >>> bodies = [gc.Body(name=name, inertia=1.0) for name in ("a", "idler", "b")]
    >>> mesh = {"teeth": (20, 20), "base_radii": (1.0, 1.0), "stiffness": 1e6, "backlash": 1e-4}
    >>> train = gc.Train(speed=600, bodies=bodies, meshes=[
    ...     gc.Mesh(between=("a", "idler"), **mesh), gc.Mesh(between=("idler", "b"), **mesh)])
    >>> found = gc.natural_frequencies(train)
    >>> found.natural_frequency.values.round(2).tolist(), found.rigid.values.tolist()
    ([0.0, 159.15, 275.66], [True, False, False])
    """
    if is_design(gears) and gears.speed is None:
        pair = gears.at(speed=1.0).to_pair()
        gears = gears.at(speed=pair.omega0 / pair.n1 / RPM)
    if is_design(gears) or isinstance(gears, GearPair):
        gears = replace(gears, damping_law="contact")  # laws differ where contact is lost
        train = Train.of_pair(gears.to_pair(), gears)
    elif isinstance(gears, Train):
        train = gears
    else:
        raise InputError("gears", "must be a Train, a GearDesign or a GearPair", f"a {type(gears).__name__}")
    found = modes(train)
    bodies, elements = ("mode", "body"), ("mode", "element")
    values: dict[str, tuple[tuple[str, ...], Any]] = {
        "natural_frequency": (("mode",), found.frequency / (2 * np.pi)),
        "damping_ratio": (("mode",), found.damping_ratio), "rigid": (("mode",), found.frequency == 0),
        "mode_angle": (bodies, found.angle), "mode_x": (bodies, found.displacement[..., 0]),
        "mode_y": (bodies, found.displacement[..., 1]), "kinetic_energy": (bodies, found.kinetic_energy),
        "mode_deflection": (elements, found.deflection), "strain_energy": (elements, found.strain_energy)}
    orders = {f"mesh {mesh.name}": train.mesh_order(mesh) for mesh in train.meshes} | train.excitation_orders()
    data = {name: variable(name, dims, value) for name, (dims, value) in values.items()}
    data["order"] = variable("order", ("excitation",), np.array([float(order) for order in orders.values()]))
    data["speed"] = variable("speed", (), np.array(float(train.speed)))
    coords = {"mode": np.arange(1, len(found.frequency) + 1), "body": [body.name for body in train.bodies],
              "element": list(found.elements), "excitation": list(orders)}
    return new_dataset(data, {n: variable(n, (n,), np.asarray(v)) for n, v in coords.items()},
                       {**provenance("natural_frequencies", model_of_gears(gears)),
                        "contacts": contacts_in_words(train)})
