"""Natural modes of a train whose meshes are all in contact, at their mean stiffnesses."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from gearchaos.gears.train.structure import Train, as_given, mean_stiffness, structure

_HARDLY, _USUAL = 5e-4, 0.01
"""Damping ratio below which a mode is hardly damped, less than that of any steel structure with joints, and a usual one
of shafts in bearings."""

_NAMED = 3  # modes that are hardly damped, those with least damping
_BODIES = 2  # named of each


@dataclass(frozen=True)
class Modes:
    """M undamped modes of unit modal mass, by frequency; those that deflect nothing have the frequency 0."""

    frequency: np.ndarray  # (M,) rad/s
    damping_ratio: np.ndarray  # (M,) by the damping of each mode alone, NaN without deflection
    angle: np.ndarray  # (M, bodies) rad, in each body's own sense of rotation
    displacement: np.ndarray  # (M, bodies, 2) m, of centres
    kinetic_energy: np.ndarray  # (M, bodies) share
    elements: tuple[str, ...]  # names of meshes, shafts and supports
    stiffness: np.ndarray  # (elements,) N/m, of shafts N m/rad
    deflection: np.ndarray  # (M, elements) m, of shafts rad; of a support that of its first axis
    strain_energy: np.ndarray  # (M, elements) share, 0 without deflection


def modes(train: Train) -> Modes:
    """The natural modes of a train."""
    found = structure(train)
    elements = found.linear
    mass = found.mass(as_given)[0]
    rows = np.array([element.row for element in elements])
    k = np.array([mean_stiffness(element) for element in elements])
    damping = rows.T @ (np.array([element.damping for element in elements])[:, None] * rows) + np.diag(
        found.ground_damping(as_given)[0])
    root = np.linalg.inv(np.linalg.cholesky(mass))  # of the mass matrix: root M rootᵀ = 1
    squares, vectors = np.linalg.eigh(root @ rows.T @ (k[:, None] * rows) @ root.T)
    shapes = (root.T @ vectors).T  # (M, n)
    rigid = np.arange(len(squares)) < found.rigid.shape[1]
    frequency = np.where(rigid, 0.0, np.sqrt(np.maximum(squares, 0.0)))
    deflection = shapes @ rows.T
    energy = np.where(rigid[:, None], 0.0, k * deflection**2 / np.where(rigid, 1.0, squares)[:, None])
    owners = [element.name if element.owner else f"support of {element.name}" for element in elements]
    names = tuple(dict.fromkeys(owners))
    of = np.array([names.index(owner) for owner in owners])
    first = [int(np.argmax(of == i)) for i in range(len(names))]
    angle, displacement = np.zeros((len(shapes), len(train.bodies))), np.zeros((len(shapes), len(train.bodies), 2))
    for b, body in enumerate(train.bodies):
        if not body.prescribed:
            angle[:, b] = found.sense(body.name) * shapes[:, found.index[body.name, "angle"]]
        displacement[:, b] = shapes @ found.centre(body).T
    inertia, weight = (np.array([getattr(body, name) or 0.0 for body in train.bodies]) for name in ("inertia", "mass"))
    kinetic = inertia * angle**2 + weight * (displacement**2).sum(axis=2)  # of unit modal mass
    largest = np.abs(kinetic).argmax(axis=1)
    forward = np.where(angle[np.arange(len(angle)), largest] < 0, -1.0, 1.0)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(rigid, np.nan, np.einsum("mi,ij,mj->m", shapes, damping, shapes) / (2 * frequency))
    return Modes(frequency, ratio, forward * angle, forward[:, :, None] * displacement, kinetic, names, k[first],
                 forward * deflection[:, first],
                 np.stack([energy[:, of == i].sum(axis=1) for i in range(len(names))], axis=1))


def fastest_mode(train: Train, period: str) -> str:
    """The mode whose vibration or decay is the fastest, which steps follow through a common period, and the parts that
    make it, in words."""
    found = modes(train)
    ratio = np.nan_to_num(found.damping_ratio)
    rates = found.frequency * np.where(ratio > 1, ratio + np.sqrt(np.maximum(ratio**2 - 1, 0.0)), 1.0)
    m = int(rates.argmax())
    b, e = int(found.kinetic_energy[m].argmax()), int(found.strain_energy[m].argmax())
    body, element = train.bodies[b].name, found.elements[e]
    damped = ratio[m] > 1
    return (f"Steps follow {'a decay' if damped else 'a vibration'} of {rates[m]:.3g} rad/s through a common period of "
            f"{period}. It is that of {body} ({100 * found.kinetic_energy[m, b]:.0f} % of its kinetic energy) on "
            f"{element} ({100 * found.strain_energy[m, e]:.0f} % of its strain energy, damping ratio {ratio[m]:.2g}). "
            f"Raise the speed, or give {body} more inertia, or {element} less "
            f"{'damping' if damped else 'stiffness, or make the bodies that it joins one'}.")


def contacts_in_words(train: Train) -> str:
    """Which contacts the modes take as closed, and which as open."""
    stops = [shaft for shaft in train.shafts if shaft.stop is not None]
    closed, beside = ([shaft.name for shaft in stops if bool(shaft.stiffness) == spring] for spring in (False, True))
    return ", ".join(["all meshes in contact at their mean stiffnesses"] * bool(train.meshes)
                     + [f"stops of {', '.join(closed)} closed"] * bool(closed)
                     + [f"stops beside the spring of {', '.join(beside)} open"] * bool(beside))


def hardly_damped(train: Train) -> Iterator[str]:
    """A sentence on each mode that hardly decays, but one for those of the same frequency: which it is, and the damping
    by which it would. Motions in which it is excited may take long, and stay undecided."""
    found, shafts = modes(train), {shaft.name: shaft for shaft in train.shafts}
    weak = np.flatnonzero((found.frequency > 0) & (found.damping_ratio < _HARDLY))
    weak = weak[np.unique(found.frequency[weak].round(6), return_index=True)[1]]
    weak = weak[np.argsort(found.damping_ratio[weak], kind="stable")]
    for m in weak[:_NAMED].tolist():
        frequency, ratio = float(found.frequency[m]), round(float(found.damping_ratio[m]), 12)
        moved = ", ".join(f"{train.bodies[b].name} {100 * found.kinetic_energy[m, b]:.0f} %"
                          for b in np.argsort(-found.kinetic_energy[m])[:_BODIES])
        e = int(found.strain_energy[m].argmax())
        name, share = found.elements[e], float(found.strain_energy[m, e])
        field = "damping" if name not in shafts or shafts[name].stiffness else "stop_damping"
        needed = 2 * _USUAL * float(found.stiffness[e]) / (frequency * share)
        yield (f"The mode of {frequency / (2 * np.pi):.4g} Hz is hardly damped, ratio {ratio:.2g}: motions may take "
               f"long to compute and stay undecided. Its kinetic energy is in {moved}, {100 * share:.0f} % of its "
               f"strain energy in {name}, where {field} = '{float(f'{needed:.2g}'):g} N*"
               f"{'m*s/rad' if name in shafts else 's/m'}' makes a ratio of {_USUAL:g}.")
    if len(weak) > _NAMED:
        yield f"So do {len(weak) - _NAMED} more modes: gearchaos modes lists all."
