"""What tolerances do at the point: a cloud of designs, in the colours of their contact, and beside it in words."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from bokeh.models import ColumnDataSource, Scatter, Span

from gearchaos.datasheet.scatter import QUASI_STATIC, answer, scatter_document, tried
from gearchaos.dynamics.response import CONTACTS
from gearchaos.explorer.core.state import View
from gearchaos.explorer.core.style import Legend, Panel, SetAttributes
from gearchaos.explorer.features.tolerances.job import Cloud
from gearchaos.plot.classes import CONTACT_CLASSES
from gearchaos.studies.uncertainty.distributions import Scattered
from gearchaos.studies.uncertainty.scattered_models import DEVIATIONS, SPREAD

_INK = "#111111"
_PARTS = 8  # of the designs by an input, whose means tell how far the factor follows it
_MARGIN = 0.04  # of an axis beyond the designs


class CloudFigure(Panel):
    """The dynamic factor of designs over the input that it follows most, and that of the gears as they are."""

    def __init__(self, set_attributes: SetAttributes) -> None:
        super().__init__(set_attributes, x_range=(0, 1), y_range=(0, 1))
        self.designs = ColumnDataSource({"x": [], "y": [], "colour": []})
        self.own = ColumnDataSource({"x": [], "y": []})
        self.level = Span(dimension="width", line_color=_INK, line_dash="dashed")
        self.figure.add_glyph(self.designs, Scatter(x="x", y="y", size=6, fill_color="colour", line_color="#777777",
                                                    line_width=0.5))
        self.figure.add_layout(self.level)
        self.figure.add_glyph(self.own, Scatter(x="x", y="y", size=13, marker="diamond", fill_color=_INK,
                                                line_color="white", line_width=1.5))

    def show(self, found: Cloud) -> None:
        """Draw the designs whose motions are bounded, one point each."""
        ds, number = found.dataset, most_followed(found.dataset)
        factor = ds["sample_factor"].values[0]
        drawn = np.isfinite(factor)
        x, y = _shown(ds, number)[drawn], factor[drawn]
        colours = [CONTACT_CLASSES[code].colour for code in ds["sample_contact"].values[0][drawn]]
        own = found.values[number]
        self._set(self.designs, data={"x": x, "y": y, "colour": colours})
        self._set(self.level, location=found.factor if np.isfinite(found.factor) else None)
        known = own is not None and bool(np.isfinite(found.factor))
        self._set(self.own, data={"x": [own], "y": [found.factor]} if known else {"x": [], "y": []})
        self._limit(_ends(x, own), _ends(y, found.factor))
        over = " / quasi-static ratio" * (scatter_document(ds)["force_over"] == QUASI_STATIC)
        name, unit, items = str(ds["varied"].values[number]), str(ds["varied_unit"].values[number]), _items(ds, number)
        words = f"{name} [{unit}]" if unit else name
        if items and not isinstance(items[0], float):
            words = f"{name}: " + ", ".join(f"{n} {each}" for n, each in enumerate(items, 1))
        self._label(words, f"dynamic factor{over}")


def most_followed(ds: xr.Dataset) -> int:
    """The number of the input that the dynamic factor of a scatter follows most.

    The designs are cut into parts by the values of the input: it is the one whose parts differ most in their means.
    """
    factor = ds["sample_factor"].values[0]
    known = np.isfinite(factor)

    def between(values: np.ndarray) -> float:
        parts = np.array_split(factor[known][np.argsort(values[known], kind="stable")], _PARTS)
        return float(np.var([part.mean() for part in parts if part.size]))

    return int(np.argmax([between(values) for values in ds["sample_value"].values])) if known.any() else 0


def _items(ds: xr.Dataset, number: int) -> tuple[Any, ...]:
    """The items of an input that is a list."""
    return Scattered.parse(f"{ds['varied'].values[number]}={ds['distribution'].values[number]}").items


def _shown(ds: xr.Dataset, number: int) -> np.ndarray:
    """The values of an input; of a list of numbers these, of texts their numbers."""
    values, items = ds["sample_value"].values[number], _items(ds, number)
    if not items:
        return values
    shown = items if all(isinstance(each, float) for each in items) else range(1, len(items) + 1)
    return np.array(list(shown), float)[values.astype(int)]


def _ends(values: np.ndarray, own: float | None) -> tuple[float, float]:
    """The ends of an axis with room beside all values."""
    every = np.array([*values, np.nan if own is None else own], float)
    every = every[np.isfinite(every)]
    low, high = (float(every.min()), float(every.max())) if every.size else (0.0, 1.0)
    room = _MARGIN * (high - low) or 0.5
    return low - room, high + room


class CloudText(NamedTuple):
    """What stands above the cloud."""

    sentences: list[str]
    tried: list[str]
    legend: Legend


def cloud_text(found: Cloud, view: View) -> CloudText:
    """The probabilities at the point of a view, what was varied, and the legend of the cloud."""
    content = scatter_document(found.dataset)
    (one,) = content["torques"]
    contact = CONTACT_CLASSES[CONTACTS.index(found.contact)].name
    at_limit = any(name.startswith(DEVIATIONS) and own is None for name, own in zip(
        content["inputs"], found.values, strict=True))
    times = " times the quasi-static ratio" * (content["force_over"] == QUASI_STATIC)
    own = f"the gears as they are{', at the limit of the grade' * at_limit}: {contact}" + (
        f", dynamic factor {found.factor:.2f}{times}" if np.isfinite(found.factor) else "")
    sentences = [f"{text[0].upper()}{text[1:]}." for text in (*answer(content, one), own)]
    source = "The inputs and their scatter are those of the study file." if view.vary else (
        f"The scatter is assumed: {100 * SPREAD:g} % either way of damping and backlash. A study file with "
        'kind = "scatter" has its own.')
    contacts = found.dataset["sample_contact"].values[0][np.isfinite(found.dataset["sample_factor"].values[0])]
    present = tuple((CONTACT_CLASSES[n].colour, CONTACT_CLASSES[n].name) for n in np.unique(contacts).tolist())
    return CloudText(sentences, [*tried(content), source],
                     Legend("Designs:", (*present, (_INK, "the gears as they are"))))
