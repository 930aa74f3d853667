"""The tip relief with which the loaded error of a drawing varies least."""

from __future__ import annotations

from collections.abc import Generator, Mapping
from typing import NamedTuple

from gearchaos.datasheet.quantities import Entry, datasheet
from gearchaos.explorer.core.drawing import Drawing
from gearchaos.explorer.core.opened import address_of
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.io.units import measured

_NAMES = ("best_tip_relief", "best_tip_relief_start", "best_loaded_error_peak_to_peak")


class Best(NamedTuple):
    """The quantities of the best tip relief of a design."""

    design: GearDesign
    entries: Mapping[str, Entry]


def best_relief(design: GearDesign) -> Generator[Best]:
    """The best tip relief, the only result of this job."""
    yield Best(design, datasheet(design, _NAMES))


def relief_text(found: Best, drawing: Drawing) -> tuple[str, str]:
    """What the best relief is, in a sentence, and the address of the drawing with it, beside itself; empty without one.
    """
    amount, start, error = (found.entries[name] for name in _NAMES)
    if not isinstance(amount.value, tuple) or not isinstance(start.value, tuple):
        return amount.reason, ""
    if not any(amount.value):
        return "No tip relief from these diameters lessens the loaded error at this torque.", ""
    amounts, starts = [measured(each, 3) for each in amount.value], [measured(each, 6) for each in start.value]
    sentence = (f"At {found.design.torque:.6g} N m the loaded error varies least with a tip relief of "
                f"{' / '.join(amounts)} µm from {' / '.join(starts)} mm: {measured(error.value, 3)} µm peak to peak.")  # type: ignore[arg-type]
    texts = dict(drawing.texts) | {"design.tip_relief.amount": ";".join(f"{each} um" for each in amounts),
                                   "design.tip_relief.start_diameter": ";".join(f"{each} mm" for each in starts)}
    own = drawing.reading.design
    if own is not None and own.torque != found.design.torque:  # of another point of the map
        texts["operation.torque"] = f"{found.design.torque:.10g} N*m"
    return sentence, address_of(Drawing.of(texts.items()), drawing)
