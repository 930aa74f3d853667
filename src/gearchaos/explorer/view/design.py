"""A gear design as values from which a study file or a script makes it again."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

from gearchaos.gears.design.gear_design import FILES, GearDesign


def design_values(design: GearDesign) -> dict[str, Any]:
    """The inputs of a design that differ from their defaults, as numbers in SI, texts, lists and tables by name."""
    required = ("teeth", "module", "face_width")
    plain = GearDesign(**{n: getattr(design, n) for n in required})
    values = {
        name: _plain(value) for name, value in asdict(design).items()
        if value is not None and (name in required or getattr(design, name) != getattr(plain, name))
    }
    for name, key in FILES:
        if isinstance(table := values.get(name), dict) and key in table:
            kept = {n: v for n, v in table.items() if v and n != "sha256"}
            values[name] = {**kept, key: str(Path(table[key]).absolute())}
    return values


def _plain(value: Any) -> Any:
    """A value with lists for tuples, and tables without the keys that are left out."""
    if isinstance(value, dict):
        return {n: _plain(v) for n, v in value.items() if v is not None}
    return [_plain(v) for v in value] if isinstance(value, (list, tuple)) else value
