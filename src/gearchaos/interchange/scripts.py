"""Stand-alone scripts that integrate a model with another tool, so that results can be checked there."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from importlib.metadata import version
from typing import Any

import jinja2
import numpy as np

from gearchaos.errors import InputError, unknown_name
from gearchaos.gears.operation.operating import AnyModel, OperatingModel, as_model
from gearchaos.gears.train.structure import mean_stiffness, structure
from gearchaos.model import COORDINATES, SCALARS, Stiffness, has_effect, vary
from gearchaos.model.base import SAMPLES
from gearchaos.model.coordinates import initial_state, initial_values, transmission_error_at_start
from gearchaos.model.switched import switched_system
from gearchaos.quantities import quantity

_TRAIN = "scipy_train.py.j2"
# The template of each tool for which scripts of pairs are written; those of trains are in _OF_TRAINS:
TEMPLATES = {"scipy": "scipy.py.j2", "dynamicalsystems.jl": "dynamicalsystems.jl.j2"}
PERIODS = 20  # mesh periods that a script integrates unless its user gives another number


def script(model: AnyModel, tool: str = "scipy") -> str:
    """A stand-alone script that integrates a model with another tool, to check a result there.

    The script for SciPy needs NumPy and SciPy alone, and prints the stroboscopic section as CSV. It integrates (2.12)
    or (2.17) in the coordinates x and y of the wheels (z in the single model) by the Runge-Kutta method of order 8 of
    Dormand and Prince with tolerances of 1e-12, and stops at every contact switch, stiffness jump and extremum of z. It
    shares no code with gearchaos. That of a train has the matrices of its equations, as gearchaos assembles them, and
    prints the coordinates of its motions after each common period.

    Of a train alone: the script for openTorsion has its linear model, and prints its natural frequencies; that for ROSS
    has its gears, and puts mesh forces that gearchaos has simulated on the nodes of rotors.

    Parameters
    ----------
    model : MeshModel, GearPair, GearDesign or Train
        With its initial values.
    tool : {"scipy", "dynamicalsystems.jl", "opentorsion", "ross"}
        "dynamicalsystems.jl" is a package of Julia.

    Returns
    -------
    str
        The text of the script: Python or Julia. Parameters are constants with the names of `MeshModel`, and comments
        name the equations of Łuczko (2008).

    Raises
    ------
    InputError
        For another tool, what is no model, tooth pairs of a pair that share the load, for Julia a train, or a damping
        that does not act always, for openTorsion a train whose centres move.

    Examples
    --------
    >>> import gearchaos as gc
    >>> text = gc.script(gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.206), "scipy")
    >>> "omega = 1.0  # mesh frequency" in text
    True
    """
    if str(tool) not in (tools := {**TEMPLATES, **_OF_TRAINS}):
        raise unknown_name("tool", str(tool), tools)
    found = as_model(model)
    if found.mesh_names:
        if tool not in _OF_TRAINS:
            raise InputError("tool", f"must be one of {', '.join(_OF_TRAINS)} for a train", str(tool))
        return _OF_TRAINS[tool](found)
    if tool not in TEMPLATES:
        raise InputError("tool", f"must be {' or '.join(TEMPLATES)} for a single pair", str(tool),
                         "A pair can be described as a [train] of two bodies.")
    found.stiffness.check_one_spring("a script")
    if (found.law.in_contact or found.law.acts_as) and tool != "scipy":
        raise InputError("damping_law", "must be always for a script in Julia", found.damping_law,
                         "The script for SciPy, tool='scipy', has all damping laws; or set damping_law='always'.")
    names, wave, error = COORDINATES[found.kind], found.stiffness, found.error
    orders = [1, len(error.amplitudes), len(wave.harmonics()[0])]
    scales = found.gears.to_pair().scales if isinstance(found, OperatingModel) else None
    batch = vary(found, {})
    x = {name: float(value[0]) for name, value in initial_values(batch).items()}
    initial = [x[name] for name in found.coordinate_names if name in x]
    if found.kind == "single":
        error0, error_dot = (float(value[0]) for value in transmission_error_at_start(batch))
        initial = [x["x1"] - x["x2"] - error0, x["x1_dot"] - x["x2_dot"] - error_dot]
        if found.initial.keys() & {"z", "z_dot"}:
            initial = [found.initial.get(name, 0.0) for name in ("z", "z_dot")]
    return _rendered(
        TEMPLATES[tool], kind=found.kind, law=found.law,
        equation=f", {wave.equation}" * bool(wave.equation), series=bool(wave.families),
        constants=[(n, _list(v) if isinstance(v, tuple) else repr(v)) for n, v in wave.numbers().items()],
        **_steps(wave),
        scalars=[{"name": n, "value": repr(getattr(found, n)), "comment": _comment(n)}
                 for n in SCALARS if has_effect(n, found.kind)],
        scales=[f"Here Δ = {scales.length!r} m and ω0 = {scales.rate!r} rad/s."] if scales else [],
        eps=_list(error.amplitudes), theta=_list(error.phases), names=list(names), names_in_words=", ".join(names),
        initial=_list(initial), largest_order=max(orders),
        columns_in_words="τ, z and z'" if found.kind == "single" else "τ, the coordinates, z and z'",
    )


def _rendered(template: str, **values: Any) -> str:
    """The text of a template with values in it."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("gearchaos.interchange"), undefined=jinja2.StrictUndefined, trim_blocks=True,
        lstrip_blocks=True, keep_trailing_newline=True)
    return environment.get_template(template).render(version=version("gearchaos"), periods=PERIODS, **values)


def _train_script(model: Any) -> str:
    """The script of a train for SciPy."""
    batch = vary(model, {})
    system = switched_system(batch)
    contacts: Any = system.contacts
    if contacts.releases.any():
        raise InputError("damping_law", "must be another one for the script of a train", model.law.name,
                         "That of a pair has all damping laws; of a train set damping_law='contact'.")
    arrays = {
        "initial": initial_state(batch, system)[0], "A": system.A[0], "f0": system.f0[0], "orders": contacts.orders,
        "f_cos": contacts.f_cos[0], "f_sin": contacts.f_sin[0], "rows": contacts.rows, "rates": contacts.rates,
        "pushes": contacts.pushes[0], "damping": contacts.damping[0], "in_contact": contacts.in_contact,
        "mesh": contacts.meshes, "side": contacts.sides, "edges": contacts.edges[0],
        "stiffness": contacts.stiffness[0].T, "offset": contacts.offset[0].swapaxes(0, 1)}
    fastest = np.sqrt(contacts.stiffest.max() * np.abs(np.einsum("kd,pkd->pk", contacts.rates, contacts.pushes)).max())
    omega = float(system.omega[0])
    length = 0.1 / max(fastest, omega * contacts.orders.max(initial=1))
    return _rendered(
        _TRAIN, **{name: repr(values.tolist()) for name, values in arrays.items()}, omega=repr(omega),
        names=list(system.names), meshes=", ".join(contacts.names), max_step=repr(float(f"{length:.2g}")),
        length=repr(model.units.length), rate=repr(model.units.rate))


def _opentorsion_script(model: Any) -> str:
    """The script of the linear train for openTorsion."""
    train, found = model.train, structure(model.train)
    if moving := [body.name for body in train.bodies if body.mass is not None]:
        raise InputError("tool", "must be another one where centres of bodies move", moving[0],
                         "In openTorsion all axes rest: leave out supports. Planets have no counterpart there.")
    names = [body.name for body in found.free]
    parts: dict[str, list[Any]] = {"disks": [(body.name, i, f"I={body.inertia!r}, c={body.damping!r}")
                                             for i, body in enumerate(found.free)], "shafts": [], "meshes": []}
    for each in found.linear:
        k, c, at = mean_stiffness(each), each.damping, np.flatnonzero(each.row).tolist()
        first, second = (float(each.row[i]) for i in (at[0], at[-1]))
        if len(at) == 1:  # the other end is held
            parts["disks"].append((each.name, *at, f"I=0.0, c={c * first**2!r}, k={k * first**2!r}"))
        elif first == -second:
            parts["shafts"].append((each.name, *at, f"k={k * first**2!r}, c={c * first**2!r}"))
        else:
            radii = abs(first), math.copysign(second, first * second)
            parts["meshes"].append((each.name, *at, f"{radii!r}, {k!r}, {c!r}"))
    return _rendered("opentorsion.py.j2", nodes=repr({name: i for i, name in enumerate(names)}), **parts)


def _ross_script(model: Any) -> str:
    """The script of the meshes of a train for ROSS."""
    train, found = model.train, structure(model.train)
    elements = {each.name: each for each in found.contacts}
    meshes = []
    for mesh in train.meshes:
        ra, rb = mesh.base_radii
        held = train.carrier(mesh)
        own = 1.0 if train.ratios[mesh.between[0]] >= (train.ratios[held] if held else 0) else -1.0
        meshes.append((repr(mesh.name), repr({
            "bodies": mesh.between, "teeth": mesh.teeth, "base_diameters": (2 * ra, 2 * rb),
            "torque_over_force": (-own * ra, own * (rb if mesh.internal else -rb)),
            "stiffness": mean_stiffness(elements[mesh.name]), "damping": mesh.damping})))
    return _rendered("ross.py.j2", samples=SAMPLES * model.most_cycles, meshes=meshes,
                     inertias=repr({body.name: body.inertia for body in train.bodies}))


_OF_TRAINS: dict[str, Callable[[Any], str]] = {
    "scipy": _train_script, "opentorsion": _opentorsion_script, "ross": _ross_script}
"""Scripts of trains, by the tool."""


def _operation(sign: str, turned: bool = False) -> Callable[[Any, object], _Text]:
    """A sum, difference, product or quotient of a `_Text` and a number or another one; ``turned``: that comes first."""
    def text(one: _Text, other: object) -> _Text:
        left, right = (f"({term})" if " " in str(term) else str(term) for term in (one, other)[:: -1 if turned else 1])
        return _Text(f"{left} {sign} {right}")

    return text


class _Text(str):
    """A name or a term in a script, with which parts of a stiffness are computed as with a number."""

    __slots__ = ()

    __add__, __radd__ = _operation("+"), _operation("+", turned=True)
    __sub__, __rsub__ = _operation("-"), _operation("-", turned=True)
    __mul__, __rmul__ = _operation("*"), _operation("*", turned=True)
    __truediv__, __rtruediv__ = _operation("/"), _operation("/", turned=True)


def _steps(stiffness: Stiffness) -> dict[str, str]:
    """Levels and starts as a script computes them; empty where they are constants of the script, or there are none."""
    if stiffness.families or stiffness.unnamed():
        return {"levels": "", "starts": ""}
    starts, levels = zip(*stiffness.parts({name: _Text(name) for name in stiffness.numbers()}), strict=True)
    return {name: f"[{', '.join(str(float(v) if isinstance(v, int) else v) for v in values)}]"
            for name, values in (("levels", levels), ("starts", starts))}


def _list(values: Sequence[float]) -> str:
    """Numbers as a list that Python and Julia read, with all digits."""
    return "[" + ", ".join(map(repr, values)) + "]"


def _comment(name: str) -> str:
    """What a scalar parameter is: its symbol, words and equation."""
    row = quantity(name)
    wheel = f" of wheel {name[-1]}" if name[-1] in "12" else ""
    return f"{row.long_name or row.title}{wheel}, {row.symbol} of {'(2.8)' if name == 'omega' else '(2.11)'}"
