"""The answer that comes before a datasheet: load, main resonance, speeds to avoid, and what they rest on."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from gearchaos.datasheet.quantities import Entry, datasheet, pair_title, with_scanned_speeds
from gearchaos.errors import InputError
from gearchaos.gears.design.checks import FAST
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.design.values import DataFile
from gearchaos.gears.io.units import RPM, measured

if TYPE_CHECKING:
    from gearchaos.studies.speeds.speed_windows import SpeedsToAvoid

# speeds that are scanned unless others are asked for, over the main resonance: from that at which a tenth harmonic
# excites it to the beginning of the supercritical range of ISO 6336-1:2006, 6.4.2
_SCANNED = (0.1, 1.5)
_SCANNED_COUNT = 60
LEFT_OUT = "must be given"  # the rule that is broken by an input that was left out of a design
LIKE_TEETH = ("the faults, pitch errors and eccentricity: all teeth are alike here. `gearchaos bifurcation --axis "
              "speed=…` takes them")


@dataclass(frozen=True)
class DesignAnswer:
    """What is known of a design at one torque; the problem says why there are no speeds to avoid, or no model."""

    design: GearDesign
    entries: Mapping[str, Entry]
    speeds: SpeedsToAvoid | None = None
    problem: InputError | None = None

    @classmethod
    def of(
        cls, design: GearDesign, speeds: SpeedsToAvoid | None = None, problem: InputError | None = None
    ) -> DesignAnswer:
        """The answer with the datasheet of a design, in which a table that cannot be read is a problem."""
        for name, method in (("mesh_stiffness", design.stiffness), ("error_harmonics", design.transmission_error)):
            if isinstance(method, DataFile):
                try:
                    getattr(design, name)
                except InputError as error:
                    problem = error
                    break
        entries = datasheet(design) if speeds is None else with_scanned_speeds(datasheet(design))
        return cls(design, entries, speeds, problem)

    def differing(self, first: DesignAnswer) -> dict[str, Entry]:
        """The quantities that are not those of another answer."""
        return {name: entry for name, entry in self.entries.items() if entry != first.entries[name]}

    @property
    def title(self) -> str:
        return pair_title(self.design)

    @property
    def pair(self) -> str:
        d = self.design
        helix = [f"β {math.degrees(d.helix_angle):.6g}°"] if d.helix_angle else []
        grade = [] if d.quality is None else [f"grade {_both(d.quality.grades)}"]
        return ", ".join([self.title, *helix, f"b {_both(d.face_width, 1e3)} mm",
                          f"a {d.geometry.centre_distance * 1e3:.6g} mm", *grade])

    @property
    def facts(self) -> Iterator[tuple[str, str]]:
        """What the speeds to avoid rest on, in words with values."""
        d = self.design
        load = "no torque is given" if d.torque is None else f"{d.torque:.6g} N m at wheel 1"
        if d.torque is not None:
            load += f", {self._value('line_load', 'F_t K_A/b' if d.application_factor != 1 else 'F_t/b')}"
            if isinstance((root := self.entries["root_stress"]).value, tuple):
                load += f", root stress {'/'.join(dict.fromkeys(measured(v, 3) for v in root.value))} {root.unit}"
        yield "load", load
        start, stop = (self._value(name).removesuffix(" rpm") for name in ("main_start", "main_end"))
        known = self.entries["resonance_speed"].value is not None
        yield "main resonance", (f"{self._value('resonance_speed')}; by ISO 6336-1 its range is {start} to {stop} rpm"
                                 if known else "not known")
        variation = ""
        if (d.shares_load or d.under_load) and self.entries["loaded_error_peak_to_peak"].value is not None:
            variation = f", mesh deflection {self._value('loaded_error_peak_to_peak')} peak to peak"
            relief = d.tip_relief
            if relief is not None and any(relief.amount) and relief.start_diameter is not None and d.shares_load and (
                    isinstance((best := self.entries["best_tip_relief"]).value, tuple)):
                single = " / ".join(f"{1e3 * diameter:.5g}" for diameter in d.geometry.single_contact_diameter)
                amounts = " / ".join(dict.fromkeys(measured(v, 3) for v in best.value))
                variation += (
                    f"; at rest least with a relief of {amounts} {best.unit} from these diameters: "
                    f"{self._value('best_loaded_error_peak_to_peak')}" if any(best.value) else
                    f"; at rest no relief from these diameters lessens it, {d.geometry.least_contact} begins at "
                    f"{single} mm")
        yield "load sharing", f"{d.sharing_in_words}{variation}"
        yield "assumed", f"{assumed_in_words(d)}: vary each"
        if d.turning:
            yield "left out", LIKE_TEETH

    @property
    def decision(self) -> list[str]:
        """What to do, in sentences: the speeds to avoid in operation, those after a load change, and usable ones."""
        from gearchaos.datasheet.assessment import decision  # here, since a datasheet alone needs none of what it loads
        from gearchaos.studies.speeds.assess import Assessment

        assert self.speeds is not None
        whole = self.speeds.largest
        return decision(Assessment(self.design, (self.speeds,), (whole.start, whole.stop)))

    @property
    def conclusion(self) -> str:
        """The decision in one sentence, or why there is none."""
        if self.speeds is None:
            if self.problem is None:
                return "not asked for"
            left_out = self.problem.rule == LEFT_OUT
            return f"not computed: {f'{self.problem.field} {LEFT_OUT}' if left_out else 'see the error'}"
        return "; ".join(self.decision)

    @property
    def basis(self) -> Iterator[str]:
        """Sentences that say how to read the speeds to avoid."""
        if self.speeds is None:
            return
        from gearchaos.studies.operation.beyond_the_teeth import BEYOND  # here, since a datasheet alone needs neither
        from gearchaos.studies.operation.quasi_static import ratio_in_words

        yield f"Tried: {self.speeds.tried}.{f' {self.speeds.coarse}' if self.speeds.coarse else ''}"
        if self.speeds.elsewhere is not None:
            outside, separate = self.speeds.elsewhere
            contact = "the teeth separate at some speeds" if separate else "in contact in all motions found"
            largest = (f"largest factor {measured(outside.dynamic_factor, 3)} at {outside.largest_at} rpm"
                       if math.isfinite(outside.dynamic_factor) else f"all of them {BEYOND}")
            yield f"Elsewhere: {contact}, {largest}."
        if ratio := ratio_in_words(self.speeds.quasi_static_ratio):
            yield f"The jumps of the stiffness alone make a factor of {ratio}, at the lowest speed, too."
        ending = "damping that ends with contact, " * (not self.design.law.in_contact)
        sharing = "contact beyond the path, " if self.design.shares_load else "load sharing, "
        if self.design.in_strips:
            sharing = "contact of teeth that do not carry the full load, "
        elif self.design.has_corner_contact:
            sharing = ""
        yield f"Left out: {sharing}{ending}other meshes, friction."

    @property
    def notes(self) -> tuple[str, ...]:
        """What the designer should know: unusual values, limits of the transmission error and of the stiffness."""
        found = (*self.design.warnings, *self.design.assumptions)
        return tuple(text for text in found if self.problem is None or str(self.problem) not in text)

    @property
    def absent(self) -> list[tuple[str, list[str]]]:
        """The reasons why quantities have no value, each with their names."""
        out: dict[str, list[str]] = {}
        for name, entry in self.entries.items():
            if entry.value is None and not entry.expected:
                out.setdefault(entry.reason.replace("; got None", ""), []).append(name)
        return list(out.items())

    def document(self) -> dict[str, Any]:
        """All of it, ready for JSON; the model is None, with the reason, where an input for it is missing."""
        from gearchaos.datasets import model_json  # here, since a datasheet alone needs none of what this loads

        try:
            model = {"model": json.loads(model_json(self.design.to_model()))}
        except InputError as error:
            model = {"model": None, "model_reason": str(error)}
        avoid: dict[str, Any] | None = None
        if self.speeds is not None:
            from gearchaos.studies.operation.factor_context import peak_root_stress

            avoid = self.speeds.document()
            for each in avoid["ranges"]:
                each["root_stress"] = peak_root_stress(self.design, self.speeds.torque, each["dynamic_factor"])
        keys = ("value", "unit", "symbol", "formula", "source")
        quantities = {name: {key: getattr(e, key) for key in keys} | ({"reason": e.reason} if e.reason else {})
                      for name, e in self.entries.items()}
        return {"quantities": quantities, **model, "warnings": [*self.design.warnings, *self.design.assumptions,
                                         *[f"Left out: {LIKE_TEETH}"] * self.design.turning],
                "speeds_to_avoid": avoid}

    def _value(self, name: str, symbol: str = "") -> str:
        """A quantity with its unit, to three digits."""
        entry = self.entries[name]
        value = "unknown" if entry.value is None else f"{measured(entry.value, 3)} {entry.unit}"  # type: ignore[arg-type]
        return f"{symbol} {value}".lstrip()


def assumed_in_words(design: GearDesign) -> str:
    """What the motions of a design rest on and a drawing does not give: stiffness, transmission error, damping."""
    law = f" {design.law.words}" * (design.damping_ratio is not None)
    return f"{', '.join(design.assumed.values())}{law}"


def default_speeds(design: GearDesign) -> str:
    """The speeds in rpm that are scanned unless others are asked for, the operating speed among them: up to the
    supercritical range, or a pitch line velocity of `FAST`. Raises `InputError` if an input of the model is missing or
    wrong.
    """
    pair = design.at(speed=design.speed or 1.0).to_pair()
    start, stop = (share * pair.omega0 / pair.n1 / RPM for share in _SCANNED)
    fast, own = FAST / (design.geometry.reference_diameter[0] / 2) / RPM, design.speed or start
    stop = max(min(stop, fast), 1.1 * own)
    return f"{float(f'{min(start, own):.2g}'):g}:{float(f'{stop:.3g}'):g}:{_SCANNED_COUNT}"


def _both(values: tuple[float, float], factor: float = 1.0) -> str:
    """The value of both wheels, or both if they differ."""
    return "/".join(dict.fromkeys(f"{v * factor:.6g}" for v in values))
