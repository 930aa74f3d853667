"""A drawing as a form: the inputs of a gear design as texts by name, and what is wrong or missing in them.

What can be asked for, and how, is declared by the fields of `gearchaos.gears.design.inputs.Inputs`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, dataclass, field, fields, replace
from functools import cache, cached_property, partial
from typing import Any

import tomlkit

from gearchaos.errors import InputError, gather, unknown_name
from gearchaos.explorer.core.form_inputs import MODULE, PITCH, RANGES, inputs
from gearchaos.explorer.core.form_words import error_in_form_words, in_form_words
from gearchaos.explorer.core.models import limits, map_cells, too_slow
from gearchaos.explorer.core.state import View, view_of
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.design.values import module_of
from gearchaos.gears.geometry.dimensions import shift_sum
from gearchaos.gears.io import units
from gearchaos.gears.io.fields import Record
from gearchaos.gears.operation.operating import model_of_gears
from gearchaos.studies.core.axis import Axis

EXAMPLE = {
    "design.teeth": "23;81", "design.module": "2.5 mm", "design.face_width": "22 mm", "design.centre_distance":
    "131.5 mm", "design.bore": "25 mm;60 mm", "design.quality.standard": "ISO 1328-1:1995", "design.quality.grade": "7",
    "design.transmission_error": "from quality (typical)", "design.backlash.value": "0.15 mm",
    "design.backlash.of": "line of action, total", "design.damping_ratio": "0.05", "operation.speed": "2000 rpm",
    "operation.torque": "60 N*m"}
"""A drawing to begin with."""

_SHIFT, _DISTANCE = "design.profile_shift", "design.centre_distance"
_HALF = "Assumed: half of the sum that the centre distance needs, each."
_NO_EFFECT = "It has no effect before a number is given with it."
_ASKED_FOR = {
    "tip_clearance": "centre_distance", "contact_ratio": "centre_distance", "start_of_active_profile": "teeth"}
"""What follows from a drawing, by the input beside which it is said that it cannot be."""
_LONGEST = 200  # most characters of a text
_SPLIT = 1e-4  # to which profile shifts are rounded down that the drawing leaves open


@dataclass(frozen=True)
class Reading:
    """What a drawing describes: a design, None if something is wrong or a size is missing, and its view if it can run.

    By key: the errors, "" for one of no input; the advice on what is needed; what is assumed for the inputs left out,
    of both wheels with a stroke between, and from what it follows.
    """

    design: GearDesign | None = None
    view: View | None = None
    errors: Mapping[str, str] = field(default_factory=dict)
    needed: Mapping[str, str] = field(default_factory=dict)
    assumed: Mapping[str, str] = field(default_factory=dict)
    because: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Drawing:
    """The texts of a form by key, without those left out; values of both wheels have a semicolon between."""

    texts: tuple[tuple[str, str], ...] = ()

    @classmethod
    def of(cls, texts: Iterable[Any]) -> Drawing:
        """A drawing from pairs of a key and a text that a browser sends; raises `InputError` for one that no form has.
        """
        found = {}
        for each in texts:
            key, text = each if isinstance(each, (list, tuple)) and len(each) == 2 else (each, "")
            if not isinstance(key, str) or key not in inputs():
                raise unknown_name("drawing", str(key)[:40], inputs())
            if not isinstance(text, str) or len(text) > _LONGEST:
                raise InputError(key, f"must be a text of at most {_LONGEST} characters", str(text)[:40])
            found[key] = text.strip()
        return cls(tuple((key, found[key]) for key in inputs() if found.get(key)))

    @classmethod
    def of_study(cls, document: Mapping[str, Any]) -> Drawing | None:
        """The drawing of a study file of a design alone, over the ranges of its map; None of one that no form has."""
        def text(key: str, value: Any) -> str:
            dimension = inputs()[key].reader.dimension if key in inputs() else None
            return f"{value} {dimension.unit}" if dimension and not isinstance(value, str) else str(value)

        texts: dict[str, str] = {}
        for table in ("design", "operation"):
            for name, value in document.get(table, {}).items():
                for part, each in value.items() if isinstance(value, Mapping) else [("", value)]:
                    key = ".".join(filter(None, (table, name, part)))
                    texts[key] = ";".join(text(key, item) for item in (each if isinstance(each, list) else [each]))
        if "design.diametral_pitch" in texts:
            texts[MODULE] = texts.pop("design.diametral_pitch")
        study = document.get("study", {})
        for name, unit in (("speed", "rpm"), ("torque", "N*m")):
            if found := re.match(rf"{name}=([^:]+):([^:]+):", f"{study.get('x')};{study.get('y')}".replace(";", "\n"),
                                 re.MULTILINE):
                texts[f"{RANGES}.{name}"] = ";".join(f"{float(end):.10g} {unit}" for end in found.groups())
        known = "design" in document and document.keys() <= {"design", "operation", "study"}
        return cls.of(texts.items()) if known and texts.keys() <= inputs().keys() else None

    def __getitem__(self, key: str) -> str:
        return dict(self.texts).get(key, "")

    @cached_property
    def values(self) -> dict[str, Any]:
        """What is given, by key. Menus alone make no table of several inputs."""
        filled = {key.rpartition(".")[0] for key, _ in self.texts if not inputs()[key].reader.names}
        return {key: inputs()[key].read(text) for key, text in self.texts
                if key.count(".") == 1 or key.rpartition(".")[0] in filled}

    def tables(self, shift: tuple[float, float] | None = None) -> dict[str, dict[str, Any]]:
        """The tables ``[design]`` and ``[operation]`` of a study file, with profile shifts that are left open here."""
        tables: dict[str, dict[str, Any]] = {"design": {}, "operation": {}}
        for key, value in (self.values | ({} if shift is None else {_SHIFT: list(shift)})).items():
            table, name, *part = key.split(".")
            if table == RANGES:
                continue
            if key == MODULE and self[key].endswith(f" {PITCH.unit}"):
                name = "diametral_pitch"
            if part:
                tables[table].setdefault(name, {})[part[0]] = value
            else:
                tables[table][name] = value
        return tables

    def toml(self, design: GearDesign | None, view: View | None = None) -> str:
        """A study file of the drawing, with the profile shifts of its design, at the point of a view and over its map.
        """
        shift = None if design is None else design.profile_shift
        left_open = _SHIFT not in self.values and any(shift or ())
        tables = self.tables(shift if left_open else None)
        document = tomlkit.document()
        if left_open:
            document.add(tomlkit.comment("The profile shifts follow from the centre distance, half of their sum each."))
        if view is not None:
            point = view.operating_point
            tables["operation"] |= {n: f"{point.value(n):.10g} {unit}" for n, unit in (
                ("speed", "rpm"), ("torque", "N*m"))}
            tables["study"] = {"kind": "zones", **{
                n: f"{a.name}={a.start!r}:{a.stop!r}:{a.count}" for n, a in (("x", view.x), ("y", view.y))}}
        for name, table in tables.items():
            document[name] = table
        return tomlkit.dumps(document)

    def changed(self, fields: Mapping[str, Any]) -> Drawing:
        """The drawing with fields of a design, in SI, in the place of its own."""
        texts = dict(self.texts)
        for name, value in fields.items():
            given = value if isinstance(value, Mapping) else vars(value) if isinstance(value, Record) else {"": value}
            for key, each in inputs().items():
                if key.startswith("design.") and key.split(".")[1] == name:
                    part = given.get(key.partition(f".{name}")[2].removeprefix("."))
                    unit = each.units[0] if each.units else ""
                    texts[key] = "" if part is None else ";".join(each.shown(part, unit))
        return Drawing.of(texts.items())

    @cached_property
    def reading(self) -> Reading:
        """What the drawing describes, with the messages of the library by the inputs that they are about."""
        missing = {f"design.{f.name}": "" for f in fields(GearDesign)
                   if (f.default is MISSING or f.name == "module") and f"design.{f.name}" not in self.values}
        if missing or self._wrong:
            return Reading(errors=self._wrong, needed=missing, assumed=_assumed(None))
        try:
            design, shift = self._design()
        except InputError as error:
            return Reading(errors=self._placed(error), assumed=_assumed(None))
        known = Reading(design, assumed=_assumed(design), because={key: _NO_EFFECT for key, _ in self.texts
                                                                   if key not in self.values})
        if shift is not None:
            known = replace(known, because={**known.because, _SHIFT: _HALF})
        try:
            view = self._view(design)
        except InputError as error:
            needed = self._needed(error) if error.value is None else {}
            return replace(known, needed=needed, errors={} if needed else self._placed(error))
        ranges = {f"{RANGES}.{a.name}": (a.start, a.stop) for a in (view.x, view.y)}
        return replace(known, view=view, assumed={**known.assumed, **{
            key: " / ".join(f"{end:g} {inputs()[key].units[0]}" for end in ends) for key, ends in ranges.items()}})

    @cached_property
    def _wrong(self) -> dict[str, str]:
        """The errors of each input by itself."""
        errors = {}
        for key, value in self.values.items():
            try:
                if key == MODULE and self[key].endswith(PITCH.unit):
                    module_of(value)
                else:
                    inputs()[key].reader(inputs()[key].path, value)
            except InputError as error:
                errors[key] = _said(error, key)
        return errors

    def _needed(self, error: InputError) -> dict[str, str]:
        """The inputs of the form that a model lacks, with the advice on each; none if it lacks others."""
        advice = {f.name: f.metadata["advice"] for f in fields(GearDesign) if "advice" in f.metadata}
        left_out = _names(error)
        return {key: in_form_words(advice[name], partial(label_of, key=key)) for key in inputs()
                if (name := key.split(".")[1]) in left_out and not key.startswith(RANGES)}

    def _design(self) -> tuple[GearDesign, tuple[float, float] | None]:
        """The design, and the profile shifts if the centre distance needs some and the drawing leaves them open."""
        tables = self.tables()
        try:
            return GearDesign.from_tables(**tables), None
        except InputError as error:
            if error.field != "profile_shift" or _SHIFT in self.values:
                raise
        names = ("teeth", "module", "diametral_pitch", "face_width", "pressure_angle", "helix_angle")
        nominal = GearDesign(**{n: v for n, v in tables["design"].items() if n in names}).geometry
        distance = units.to_si("centre_distance", tables["design"]["centre_distance"], units.LENGTH)
        half = math.floor(shift_sum(replace(nominal, centre_distance=distance)) / 2 / _SPLIT) * _SPLIT
        shift = round(half, 4), round(half, 4)
        return GearDesign.from_tables(**self.tables(shift)), shift

    def _view(self, design: GearDesign) -> View:
        """The view of a design over the ranges of the drawing; raises `InputError` where an input is missing."""
        model = model_of_gears(design)

        def checked(key: str, *values: float) -> None:
            name, ends, unit = inputs()[key].path, limits(model, inputs()[key].path), inputs()[key].parts(self[key])[1]
            for value in values:
                high = value > ends[1]  # of a torque that is too high the least would follow from itself
                if high or value < ends[0]:
                    (end,), (own,) = (inputs()[key].shown(each, unit) for each in (ends[high], value))
                    raise InputError(key, f"must be at {'most' if high else 'least'} {end} here", own,
                                     too_slow(model) if name == "speed" and not high else "")

        def axis(name: str) -> Axis | None:
            key = f"{RANGES}.{name}"
            checked(f"operation.{name}", getattr(design, name))
            if key not in self.values:
                return None
            start, stop = inputs()[key].reader(key, self.values[key])
            checked(key, start, stop)
            return Axis(name, start, stop, map_cells(model)[0])

        x, y = gather(lambda name=name: axis(name) for name in ("speed", "torque"))  # type: ignore[misc]
        return view_of(model, x, y)

    def _placed(self, error: InputError) -> dict[str, str]:
        """An error at the input that it is about; at "" if it is about none."""
        if error.field in inputs():
            return {error.field: _said(error, error.field)}
        name = re.sub(r"\[\d\]", "", error.field)
        if name in _ASKED_FOR:
            return {key: _said(error, key, named=True) for key in [f"design.{_ASKED_FOR[name]}"]}
        about = {"diametral_pitch": "module", "omega": "speed"}.get(name, name)
        near = [key for key, each in inputs().items() if f"{about}.".startswith(f"{each.path}.")
                or f"{each.path}.".startswith(f"{about}.")]
        near.sort(key=lambda key: key not in self.values)  # one that is given, if there is any
        key = near[0] if near else ""
        return {key: _said(error, key, named=not near)}


def changes(before: Drawing, after: Drawing) -> list[tuple[str, str, str]]:
    """The inputs in which two drawings differ, but for the operating point: in words, what each has; "not given" where
    it has none."""
    def shown(text: str) -> str:
        return text.replace(";", " / ").replace(" um", " µm") or "not given"

    return [(each.label, shown(before[key]), shown(after[key])) for key, each in inputs().items()
            if before[key] != after[key] and key.startswith("design.")]


def _names(error: InputError) -> list[str]:
    """The inputs that an error is about."""
    return re.split(", | and ", error.field)


def _said(error: InputError, key: str, named: bool = False) -> str:
    """A message in the words of the form, by default without the name of the input beside which it stands."""
    dimension = inputs()[key].reader.dimension if key else None
    return error_in_form_words(error, partial(label_of, key=key), dimension.unit if dimension else "", named)


def label_of(name: str, key: str = "") -> str:
    """The label of an input by the name that it has in a message beside another one: in the table of that, or by
    itself; empty for what the form does not have."""
    given = {"diametral_pitch": "module"}.get(name, name)
    own = (*(f"{table}.{given}" for table in (key.rpartition(".")[0], "design", "operation")),
           *(each for each in inputs() if each.endswith(f".{given}")))
    tables = (each for each in inputs() if each.startswith(f"design.{name}."))
    found = next((inputs()[each].label for each in own if each in inputs()), "")
    return found or name.replace("_", " ") * any(tables)


def _assumed(design: GearDesign | None) -> dict[str, str]:
    """What is taken for each input that is left out: of a design or its geometry, or else the default; empty for none.
    """
    out = {}
    later = () if design else _of_motions()
    for key, each in inputs().items():
        name, _, part = each.path.partition(".")
        value = each.default
        if key.startswith(RANGES):
            out[key] = "usual / usual"
            continue
        if design is not None and not each.reader.names:
            value = getattr(design, name)
            value = getattr(design.geometry, name, None) if value is None else getattr(value, part) if part else value
        shown = value is not None and value != ()
        unit = each.units[0] if each.units else ""
        out[key] = " / ".join(each.shown(value, unit)) if shown else "needed for motions" * (name in later)
    return out


@cache
def _of_motions() -> list[str]:
    """The names of the inputs without which a design has no model."""
    try:
        GearDesign.from_tables({n: inputs()[f"design.{n}"].read(EXAMPLE[f"design.{n}"]) for n in (
            "teeth", "module", "face_width")}).to_pair()
    except InputError as error:
        return _names(error)
    return []
