"""The order spectrum of a steady motion: its lines by mesh harmonic and sideband, envelope and cepstrum."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Self, cast

import numpy as np

from gearchaos.datasets import model_json, new_dataset, variable, variables
from gearchaos.dynamics import Classification, Label, classify, motion_name
from gearchaos.dynamics.settings import SINGLE_MOTION
from gearchaos.dynamics.time_series import line_amplitudes, modulation, real_cepstrum
from gearchaos.errors import InputError, unknown_name
from gearchaos.execute.machine import check_memory
from gearchaos.flow import OK, ExactFlow
from gearchaos.gears.io.measured_quantities import MEANING, MEASURED, MeasuredQuantity
from gearchaos.gears.operation.operating import as_model
from gearchaos.gears.operation.results import unit_of
from gearchaos.model import MeshModel
from gearchaos.model.coordinates import mesh_rotation
from gearchaos.model.switched import SwitchedAffine
from gearchaos.studies.core.cost import Cost
from gearchaos.studies.core.declaration import function_of
from gearchaos.studies.core.initial_value_problems import initial_value_problems
from gearchaos.studies.core.options import option
from gearchaos.studies.core.study import ClassifyingStudy
from gearchaos.studies.vibration.mesh_study import MeshStudy

if TYPE_CHECKING:
    import xarray as xr

FLOOR = 1e-5
"""Amplitude of lines that count as rounding errors, over that of the strongest one."""

_OVERSAMPLED, _EXACT = 4, 64
"""How many times as many instants the flow samples, of a band and of exact lines. From lines beyond those that are kept
each line has an error: of a force that jumps by J between two of N instants up to J/N, of one by the motion with such a
jump up to J k²/N³ in line k, since the lines of a displacement fall with the cube of their number."""

_TABLE = 1 << 24  # most bytes of the step matrices of a period in one contact state, beyond which there are fewer
_WINDOWS = 16  # in a record of a motion that does not repeat; others may last that long
_NAMED = 12  # strongest mesh harmonics that have names, and as many other lines


class Wheels(NamedTuple):
    """What the lines of a spectrum are named by; orders are those of the turn of the first wheel."""

    meshes: dict[str, Fraction]  # orders of the meshes by name, the one that is looked at first
    turns: dict[Fraction, str]  # the wheels by the order of their turns
    excitations: dict[Fraction, str]  # what else has an order
    base: Fraction  # of the common period

    def name(self, order: Fraction, repeats: int) -> tuple[str, Fraction | None]:
        """The name of the line at an order, and the order of the mesh harmonic of which it is a sideband.

        A motion that ``repeats`` after several common periods also has lines at fractions of their order; one that
        never does has a band, in which only multiples of that order are named by mesh and wheel.
        """
        of = {mesh: f" of {mesh}" * (len(self.meshes) > 1) for mesh in self.meshes}
        harmonics = {mesh: order / each for mesh, each in self.meshes.items()}
        for mesh, harmonic in harmonics.items():
            if harmonic.denominator == 1:
                return f"mesh {harmonic}{of[mesh]}", None
        if order in self.excitations:
            return self.excitations[order], None
        if not repeats and (order / self.base).denominator > 1:
            return f"order {float(order):g}", None
        found, several = [], max(repeats, 1)
        for mesh, harmonic in harmonics.items():
            if several % harmonic.denominator == 0:
                return f"{harmonic} mesh{of[mesh]}", None
            carrier = round(harmonic) * self.meshes[mesh]
            for turn, wheel in self.turns.items():
                number = (order - carrier) / turn
                if several % number.denominator == 0:
                    found.append((abs(number), number, carrier, f"mesh {round(harmonic)}{of[mesh]}", wheel))
        if not found:
            return f"order {float(order):g}", None
        size, number, carrier, harmonic_name, wheel = min(found, key=lambda each: each[0])
        if not carrier:
            return f"turn {size} of {wheel}", None
        return f"{harmonic_name} {'+-'[number < 0]} {size} turn{'s' * (size > 1)} of {wheel}", carrier


class _Spectrum(NamedTuple):
    """The lines of a motion; line k has the order k/turns."""

    turns: int  # of the first wheel in a window
    amplitude: np.ndarray  # (O,), peaks, in the unit of the variable
    carrier: int  # the line of the strongest mesh harmonic
    modulation: np.ndarray  # (E,) of lines 1 to E of the envelope about it
    motion: str  # its kind
    repeats: int  # periods after which it does, 0 if it does not

    def strongest(self, mesh: int) -> list[int]:
        """The strongest lines besides the mean: harmonics of the line ``mesh``, and as many others. Of a motion that
        does not repeat they are local maxima."""
        size = np.where(self.amplitude > FLOOR * np.nanmax(self.amplitude[1:], initial=0.0), self.amplitude, 0.0)
        size[0] = 0.0
        if not self.repeats:
            size[1:-1][(size[1:-1] < size[:-2]) | (size[1:-1] < size[2:])] = 0.0
        harmonic = np.arange(len(size)) % mesh == 0
        return [int(k) for kind in (harmonic, ~harmonic)
                for k in np.argsort(-size * kind, kind="stable")[:_NAMED] if size[k] * kind[k] > 0]


@dataclass(frozen=True)
class Orders(ClassifyingStudy, MeshStudy):
    """Compute the order spectrum of a steady motion, its lines named by mesh harmonics and sidebands.

    The motion is that reached from rest, or from the initial values of the gears, as `regime` classifies it. If it
    repeats, its window does with it, and the lines are exact, those of a force by the motion of the bodies. Otherwise
    they are root mean squares over Hann windows of two turns of the first wheel.

    Returns
    -------
    xarray.Dataset
        Over ``order``, of the turn of the first wheel, with its ``order_frequency``: ``order_force``,
        ``order_deflection``, ``order_transmission_error`` or ``order_acceleration``, the amplitude at each order;
        ``line``, the names of the 12 strongest mesh harmonics and of as many other lines, empty for the rest;
        ``sideband_ratio``, the amplitude of a named sideband over that of its mesh harmonic. With ``against`` also
        ``against_order_force``, that of the other gears. Over ``modulation_order`` ``modulation``, the spectrum of the
        envelope about the strongest mesh harmonic, within half a mesh order: its amplitude over its mean. Over
        ``quefrency`` ``cepstrum``, the real cepstrum.

        The attribute ``amplitude`` is "peak" or "rms", ``carrier`` the order of the strongest mesh harmonic, ``motion``
        the kind of motion, ``window`` how the lines were found, ``status`` "ok" or "diverged".

    Raises
    ------
    InputError
        If the gears are not known, or those compared have other teeth or another speed.

    Notes
    -----
    The deflection is 0 where the front flanks touch. The transmission error is the deflection and the error e(t) of the
    teeth; bearings that give way are no part of it. The acceleration is its second derivative, the relative one of the
    wheels: the amplitude of the transmission error times (2πf)².

    Examples
    --------
    >>> import gearchaos as gc
    >>> pair = gc.GearPair(n1=25, n2=40, I1=4.88e-4, I2=3.2e-3, R1=0.03524, R2=0.05638, c0=4e8, k=2000.0,
    ...                    backlash=1.2e-4, M10=85.0, speed=4000.0, error_amplitudes=[2e-6])
    >>> found = gc.physical(gc.orders(pair))
    >>> strongest = found.order_force[1:].idxmax().item()
    >>> strongest, found.line.sel(order=strongest).item(), found.attrs["motion"]
    (100.0, 'mesh 4', '1T')

    As a value
    ----------
    >>> import gearchaos as gc
    >>> pair = gc.GearPair(n1=25, n2=40, I1=4.88e-4, I2=3.2e-3, R1=0.03524, R2=0.05638, c0=4e8, k=2000.0,
    ...                    backlash=1.2e-4, M10=85.0, speed=4000.0, error_amplitudes=[2e-6])
    >>> study = gc.Orders(pair, quantity="deflection")
    >>> study.kind, study.count
    ('orders', 1)
    """

    kind: ClassVar[str] = "orders"
    rank: ClassVar[int] = 5
    group: ClassVar[str] = "Gears"
    summary: ClassVar[str] = "orders"
    model_words: ClassVar[str] = "Given gears, with their speed and torque."
    default_settings: ClassVar[Classification] = SINGLE_MOTION

    quantity: MeasuredQuantity = option("mesh force", f"What the spectrum is of. {MEANING}")
    rms: bool = option(False, "Root mean squares of the lines instead of their peaks.")
    against: MeshModel | None = option(
        None, "Gears of the same teeth and speed, of which the spectrum is given as well.", in_files=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self._at >= len(self._teeth):  # stops between which a shaft plays
            raise unknown_name("mesh", str(self.mesh), self.model.mesh_names[: len(self._teeth)])
        if self.against is not None:
            self._set(against=as_model(self.against))
            own, other = self._rotation, self._other._rotation
            if own != other:
                raise InputError("against", "must have the same speed and numbers of teeth", other,
                                 f"The gears have {own}.")
        instants = _WINDOWS * self._window * self._instants(False)
        check_memory("periods times samples", instants, 8 * (self.cost.dimension + 20))

    @property
    def _other(self) -> Self:
        """The study of the gears with which these are compared."""
        return replace(self, model=cast(MeshModel, self.against), against=None)

    def _instants(self, repeats: bool) -> int:
        """Instants in a period at which the flow samples: of a motion that repeats so many that jumps of the force have
        their place, as far as the step matrices of a period have room."""
        least = self._samples * max(_OVERSAMPLED, self._finer(self.model.value("speed")))  # type: ignore[arg-type]
        d = self.cost.dimension
        room = int(_TABLE // (8 * d * (d + 1) * least)) if repeats else 1
        return least * 2 ** (min(max(room, 1), _EXACT // _OVERSAMPLED).bit_length() - 1)

    @property
    def _variable(self) -> str:
        return MEASURED[self.quantity].variable

    @property
    def _teeth(self) -> list[tuple[int, int]]:
        """The numbers of teeth of each mesh."""
        model: Any = self.model
        if model.mesh_names:
            return [mesh.teeth for mesh in model.train.meshes]
        return [(model.gears.to_pair().n1, model.gears.to_pair().n2)]

    @property
    def _rotation(self) -> str:
        """The speed and the numbers of teeth in words."""
        return f"{self.model.value('speed'):.10g} rpm and {', '.join(f'{a}/{b}' for a, b in self._teeth)} teeth"

    @cached_property
    def _wheels(self) -> Wheels:
        model: Any = self.model
        turns: dict[Fraction, str]
        if not model.mesh_names:
            ((first, second),) = self._teeth
            turns = {Fraction(first, second): "wheel 2"} | {Fraction(1): f"wheel 1{' or 2' * (first == second)}"}
            return Wheels({"mesh": Fraction(first)}, turns, {}, Fraction(first))
        train, own = model.train, model.train.meshes[self._at]
        meshes = {mesh.name: order for mesh in (own, *train.meshes) if (order := train.mesh_order(mesh))}
        wheels = [(train.mesh_order(own) / teeth, name) for name, teeth in zip(own.between, own.teeth, strict=True)]
        turns = {}
        for turn, name in (*wheels, *((abs(ratio), name) for name, ratio in train.ratios.items())):
            if turn and name not in turns.get(turn, "").split(" or "):
                turns[turn] = f"{turns[turn]} or {name}" if turn in turns else name
        excitations = {order: name for name, order in train.excitation_orders().items() if name.startswith("order ")}
        return Wheels(meshes, turns, excitations, train.base_order)

    @cached_property
    def cost(self) -> Cost:
        return self.estimate(1, self.classification.max_periods)

    def dataset(self, *, progress: bool = False, threads: int | None = None) -> xr.Dataset:
        found, speed = self._spectrum(), float(self.model.value("speed"))  # type: ignore[arg-type]
        name, order = self._variable, np.arange(len(found.amplitude)) / found.turns
        coords = {"order": order, "quefrency": np.linspace(0.0, found.turns / 2, len(order)),
                  "modulation_order": np.arange(1, len(found.modulation) + 1) / found.turns}
        shown = np.append(1.0, np.full(len(order) - 1, math.sqrt(0.5) if self.rms else 1.0))
        line, ratio = np.full(len(order), "", object), np.full(len(order), np.nan)
        for k in found.strongest(self._mesh_line(found.turns)):  # of sidebands the ratio to their mesh harmonic
            line[k], carrier = self._wheels.name(Fraction(k, found.turns), found.repeats)
            at = None if carrier is None else round(carrier * found.turns)
            if at is not None and at < len(ratio) and found.amplitude[at] > FLOOR * found.amplitude[1:].max():
                ratio[k] = found.amplitude[k] / found.amplitude[at]
        values = {name: found.amplitude * shown, "line": line.astype(str), "sideband_ratio": ratio}
        window = f"Hann, {2 * _WINDOWS - 1} windows of {found.turns} turns that overlap by half"
        attrs = {"amplitude": "rms" if self.rms else "peak", "carrier": found.carrier / found.turns,
                 "motion": found.motion, "window": f"none, {found.turns} turns" if found.repeats else window,
                 "status": "diverged" if found.motion == "diverged" else "ok"}
        if self.against is not None:
            other, amplitude = self._other._spectrum(), np.zeros(len(order))  # 0 where the other has no line
            units = [unit_of(name, cast(Any, each).gears.to_pair().scales) for each in (self.against, self.model)]
            factor = units[0][0] / units[1][0] if units[0] and units[1] else 1.0
            lines = np.arange(len(other.amplitude)) * found.turns
            own = (lines % other.turns == 0) & (lines < len(order) * other.turns)
            amplitude[lines[own] // other.turns] = factor * other.amplitude[own]
            values[f"against_{name}"] = amplitude * shown
            attrs["against"] = model_json(self.against)
        data = variables(("order",), values)
        data |= variables(("modulation_order",), {"modulation": found.modulation})
        data |= variables(("quefrency",), {"cepstrum": real_cepstrum(found.amplitude, FLOOR)})
        settings = {n: getattr(self, n) for n in ("quantity", "mesh", "samples", "rms")}
        frequency = variable("order_frequency", ("order",), order * speed / 60)
        return new_dataset(data, {**{n: variable(n, (n,), v) for n, v in coords.items()}, "order_frequency": frequency,
                                  **self._mesh_coordinate}, {**self.provenance(**settings), **attrs})

    def _record(self) -> tuple[str, int, int, np.ndarray]:
        """The kind of the steady motion, the periods after which it repeats, 0 if it does not, those in a window, and
        samples of the signal: one window of a motion that repeats, else several."""
        start = initial_value_problems(self.model)
        verdict = classify(start.flow, start.w, settings=self.classification, response=False)
        label, repeats = Label(verdict.label[0]), int(verdict.period[0])
        longer = repeats // math.gcd(repeats, self._window)
        name, repeats = motion_name(label, repeats), repeats if longer <= _WINDOWS else 0
        window = self._window * longer if repeats else self._window
        flow, diverged = ExactFlow(start.flow.system, self._instants(repeats > 0)), label == Label.DIVERGED
        out = flow.advance(np.where(diverged, 0.0, verdict.w), repeats or _WINDOWS * window, sample=True)
        system, samples = flow.system, out.samples[..., 0]  # (N, M, d + 1) of N periods
        w, contacts = samples[..., :-1].reshape(-1, samples.shape[2] - 1), system.contacts
        if self.quantity == "mesh force":
            forces = force_by_motion(system, samples[..., :-1]) if repeats else None
            signal = self._forces(system, samples) if forces is None else forces[:, self._at]
        elif self.quantity == "deflection":
            signal = w[:, 0] - 1 if contacts is None else w @ contacts.rows[self._at] - contacts.front[self._at]
        else:
            share = np.tile(np.arange(samples.shape[1]) / samples.shape[1], len(samples))
            signal = mesh_rotation(start.batch, system.names, w, share, self._at)
        signal = np.tile(signal, window // repeats if repeats else 1)
        if diverged or out.status[0] != OK:
            return motion_name(Label.DIVERGED, 0), 0, window, np.full_like(signal, np.nan)
        return name, repeats, window, signal

    def _spectrum(self) -> _Spectrum:
        """The spectrum of the motion that is reached."""
        motion, repeats, periods, signal = self._record()
        turns = int(periods / self._cycles_per_turn)
        kept = periods * self._samples // 2 + 1
        windows, power = 1 if repeats else _WINDOWS, 0
        amplitude = line_amplitudes(signal, len(signal) // windows, bool(repeats))[:kept]
        if self.quantity == "acceleration":
            model, power = cast(Any, self.model), 2
            rate = np.arange(kept) / turns * model.value("speed") * (2 * math.pi / 60)
            amplitude = amplitude * model.gears.to_pair().scales.length * rate**2
        mesh = self._mesh_line(turns)
        carrier, envelope = mesh, np.zeros(mesh // 2 - 1)
        if (amplitude[mesh::mesh] > FLOOR * amplitude[1:].max()).any():
            carrier = mesh * (1 + int(np.argmax(amplitude[mesh::mesh])))
            envelope = modulation(signal, windows, carrier, mesh // 2, bool(repeats), power)
        return _Spectrum(turns, amplitude, carrier, envelope, motion, repeats)

    def _mesh_line(self, turns: int) -> int:
        """The line of the mesh that is looked at, in a window of this many turns."""
        return round(next(iter(self._wheels.meshes.values())) * turns)


def force_by_motion(system: SwitchedAffine, samples: np.ndarray) -> np.ndarray | None:
    """The force of each mesh (N M, K) that moves the bodies as they move, from samples (N, M, d) of N periods after
    which the motion repeats; None where several forces could.

    Its lines F follow from those of w' = A w + f − Σ push F. Of a pair they are those of S = q − ε'' − z''.
    """
    (periods, _, d), contacts = samples.shape, system.contacts
    w = samples.reshape(-1, d)
    lines = np.fft.rfft(w, axis=0)
    rate = 2j * np.pi * np.arange(len(lines)) / (periods * system.period[0])
    A, forcing = system.A[0], np.zeros_like(lines)
    forcing[0] = len(w) * system.f0[0]
    if contacts is None:
        pushes, rates, number = system.b[:1], np.eye(d)[1:2], np.arange(1, system.f_cos.shape[1] + 1)
        damping = system.damping[:1] * (not system.law.in_contact)
        waves = (system.f_cos[0] - 1j * system.f_sin[0])[:, None] * np.eye(d)[1]
    else:
        pushes, rates, number = contacts.pushes[0], contacts.rates, contacts.orders
        damping, waves = contacts.damping[0] * ~contacts.in_contact, contacts.f_cos[0] - 1j * contacts.f_sin[0]
    if np.linalg.matrix_rank(pushes) < len(pushes):
        return None
    forcing[number * periods] += len(w) / 2 * waves
    for i, row in enumerate(A):  # velocities whose displacement is a coordinate
        if np.count_nonzero(row) == 1 and row.max() == 1 and not (forcing[:, i].any() or pushes[:, i].any()):
            lines[:, np.argmax(row)] = rate * lines[:, i]
    free = A + pushes.T @ (damping[:, None] * rates)  # without the damping of the meshes, which is part of their force
    return np.fft.irfft((lines @ free.T + forcing - rate[:, None] * lines) @ np.linalg.pinv(pushes), len(w), axis=0)


orders = function_of(Orders)

