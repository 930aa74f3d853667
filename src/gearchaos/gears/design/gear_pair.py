"""From a gear design to the gear pair of the equations (2.1): mesh stiffness, transmission error, damping, supports."""

from __future__ import annotations

import math
from contextlib import suppress
from functools import lru_cache
from typing import Any

import numpy as np

from gearchaos.errors import ChangedFileError, InputError
from gearchaos.gears.design.drawing import Drawing
from gearchaos.gears.design.values import ErrorFile, ErrorTable, OrdersFile, TableFile, checksum
from gearchaos.gears.pair import GearPair
from gearchaos.gears.stiffness.mesh_stiffness import MeshStiffness, methods
from gearchaos.gears.stiffness.table import from_table as stiffness_from_table
from gearchaos.gears.transmission_error.harmonics import ErrorHarmonics, from_quality
from gearchaos.gears.transmission_error.quality import tolerances
from gearchaos.gears.transmission_error.tables import from_orders
from gearchaos.gears.transmission_error.tables import from_table as error_from_table
from gearchaos.gears.transmission_error.tip_relief import from_tip_relief

NO_ERROR = ErrorHarmonics(amplitudes=(), phases=(), source="none: the gears are taken to be exact")


def stiffness_of(design: Drawing) -> MeshStiffness:
    """The mesh stiffness by the method of the design.

    That by ISO 6336-1 depends on the torque by the rule for low loads; the others do not.
    """
    if isinstance(design.stiffness, TableFile):
        return _table_stiffness(design.stiffness, design.teeth[0], design.geometry.common_face_width)
    return methods()[design.stiffness].compute(design)


def comparable_stiffnesses(design: Drawing) -> tuple[MeshStiffness, ...]:
    """The mesh stiffness by the method of the design, then by all others that can be computed, unlike those without a
    bore or for helical gears.
    """
    found = [stiffness_of(design)]
    for method in methods().values():
        if method.name != design.stiffness:
            with suppress(InputError):
                found.append(method.compute(design))
    return tuple(found)


@lru_cache(maxsize=64)
def _table_stiffness(file: TableFile, teeth: int, face_width: float) -> MeshStiffness:
    """The stiffness of a table with this content, read once."""
    _check_unchanged("stiffness.table", file.table, file.sha256)
    return stiffness_from_table(file.table, teeth=teeth, speed=file.speed, face_width=face_width,
                                columns=dict(file.columns))


def _check_unchanged(field: str, path: str, sha256: str) -> None:
    """Raise `ChangedFileError` if the content of a file is no longer that with which the design was made."""
    if checksum(path) != sha256:
        raise ChangedFileError(field, "must be the file with which the design was made", path,
                         "It is missing or was changed since. Make the design again, or restore the file.")


def error_of(design: Drawing) -> ErrorHarmonics:
    """The transmission error of the unloaded gears by the method of the design.

    Measured errors contain all deviations. Those from the accuracy grade and from the tip relief are added up.
    """
    method = design.transmission_error
    if isinstance(method, ErrorFile):
        radius = method.wheel and design.geometry.base_diameter[method.wheel - 1] / 2
        return _file_error(method, design.teeth, design.module / 2, radius)
    if design.exact:
        return NO_ERROR
    quality = design.given("quality")
    found: list[ErrorHarmonics] = [from_quality(design.geometry, quality, tolerances(quality, design.geometry))]
    if design.path_relief is not None:
        found.append(from_tip_relief(design.geometry, design.path_relief))
    if len(found) == 1:
        return found[0]
    total = np.zeros(max(len(part.amplitudes) for part in found), complex)
    for part in found:
        total[: len(part.amplitudes)] += np.array(part.amplitudes) * np.exp(-1j * np.array(part.phases))
    return ErrorHarmonics(
        amplitudes=tuple(np.abs(total).tolist()), phases=tuple((-np.angle(total)).tolist()),
        source="; ".join(part.source for part in found),
        residual_rms=math.hypot(*(part.residual_rms for part in found)),
        residual_peak=sum(part.residual_peak for part in found),
        warnings=tuple(warning for part in found for warning in part.warnings),
        assumptions=tuple(text for part in found for text in part.assumptions),
    )


@lru_cache(maxsize=64)
def _file_error(file: ErrorFile, teeth: tuple[int, int], most: float, radius: float | None) -> ErrorHarmonics:
    """The error in a file with this content, read once.

    ``most`` is the largest plausible amplitude, m; ``radius`` the base radius of the wheel whose angle the error is.
    """
    options: dict[str, Any] = {"most": most, "radius": radius, "columns": dict(file.columns)}
    if isinstance(file, OrdersFile):
        _check_unchanged("transmission_error.orders", file.orders, file.sha256)
        return from_orders(file.orders, teeth, **options)
    assert isinstance(file, ErrorTable)
    _check_unchanged("transmission_error.table", file.table, file.sha256)
    return error_from_table(file.table, teeth[0], **options)


def gear_pair(design: Drawing) -> GearPair:
    """The gear pair with the parameters of (2.1) at the operating point of a design.

    The reference stiffness c0 is the time mean of the mesh stiffness. The resisting torque balances the driving one;
    there is no bearing friction. Raises `InputError` if an input that the pair needs is missing: speed, torque,
    backlash, damping ratio, and inertia or bore.
    """
    weighed = design.mass is not None or (design.inertia is not None and design.supports is None)
    needed = [*["quality"] * (design.transmission_error == "from quality"), *["bore"] * (not weighed),
              *(() if isinstance(design.stiffness, TableFile) else methods()[design.stiffness].needs),
              "backlash", "damping_ratio", "speed", "torque"]
    design.require(dict.fromkeys(needed))
    stiffness, error, geometry = stiffness_of(design), error_of(design), design.geometry
    reference, mass = stiffness.reference, design.equivalent_mass
    supports: dict[str, Any] = {}
    if design.supports is not None:
        (c1, c2), (m1, m2), (first, second) = design.supports.stiffness, design.masses, design.supports.damping_ratio
        supports = {"m1": m1, "m2": m2, "c1": c1, "c2": c2, "k1": 2 * first * math.sqrt(c1 * m1),
                    "k2": 2 * second * math.sqrt(c2 * m2)}
    return GearPair(
        n1=design.teeth[0], n2=design.teeth[1], I1=design.inertias[0], I2=design.inertias[1],
        R1=geometry.base_diameter[0] / 2, R2=geometry.base_diameter[1] / 2, c0=reference,
        k=2 * design.given("damping_ratio") * math.sqrt(reference * mass), backlash=design.backlash_line_of_action,
        M10=design.given("torque"), speed=design.given("speed"), error_amplitudes=error.amplitudes,
        error_phases=error.phases, **stiffness.waveform.to_pair(reference), **supports,
    )
