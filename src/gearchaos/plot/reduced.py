"""Reduction of a map with more cells than a picture has pixels: one value for each block of cells, read part by part.

Of the classes in a block it shows the one that is rarest in the whole map: thin zones stay visible. Of a continuous
variable it shows the mean.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import prod

import numpy as np
import xarray as xr

from gearchaos.datasets import parts
from gearchaos.execute.progress import bar
from gearchaos.export import Block, Convert
from gearchaos.plot.classes import motion_class, named_classes

_MOST_CELLS = 2000
"""Most cells along each side of a map that is drawn as it is."""

_MOST_BLOCKS = 1000
"""Most blocks along each side of a reduced map. A picture with `DPI` has at least a pixel for each, so that it shows
them all."""

DPI = 300
"""Resolution of the picture of a reduced map, in dots per inch."""

_MOST_COUNTED = 2**16
"""Largest range of codes that are counted rather than sorted, however few cells there are."""

State = tuple[int, ...]
"""The values of the integer variables of a cell."""


def is_larger(dataset: xr.Dataset) -> bool:
    """Whether a result is a map with more cells along a side than are drawn as they are."""
    return dataset.attrs.get("study") == "zones" and max(dataset["label"].shape) > _MOST_CELLS


def reduced(
    dataset: xr.Dataset, block: Block, convert: Convert, colour: str | None = None, *, most: int = _MOST_BLOCKS,
    progress: bool = False,
) -> tuple[xr.Dataset, str]:
    """A map reduced to at most ``most`` blocks of cells along each side, of equal sizes up to one cell.

    The ``dataset`` is from `gearchaos.zones`, with dims (y, x), and its variables may be larger than the memory:
    ``block`` has the sizes of the parts that are read at once, along y and x. ``convert`` is applied to each part with
    its coordinates, and may scale variables. The picture will show the variable ``colour``, the kind of motion if left
    out.

    Returns the variables for the picture, with the centres of the blocks as coordinates, and a note on what was done.
    Integer variables, such as ``label`` and ``period``, have in each block the values of its class that is rarest in
    the whole map. Floats, and integers with too many values for classes, have the mean of the finite values of the
    computed cells.
    """
    names = ["label", "period", *(["contact"] if "contact" in dataset else [])]
    shown = colour if colour in dataset.data_vars and colour not in names else None
    chosen = dataset[[*names, *([shown] if shown else [])]]
    cells = _Parts(chosen, block, convert, most, progress)
    coded = shown is not None and dataset[shown].dtype.kind in "iu"
    counts = cells.counts([*names, shown] if coded and shown else names)
    if coded and named_classes(_cells(chosen, counts), str(shown)) is None:
        out: Counter[State] = Counter()
        for state, count in counts.items():
            out[state[:-1]] += count
        counts, coded = out, False
    ranked = [state for state in counts if state[0] > 0]  # those of computed cells
    if ranked:  # from those of the most frequent class to those of the rarest
        each = _cells(chosen, ranked)
        named = named_classes(each, colour) if colour is not None and colour in each else None
        index = motion_class(each["label"], each["period"]) if named is None else named[0]
        members, classes = Counter[int](), dict(zip(ranked, index.tolist(), strict=True))
        for state in ranked:
            members[classes[state]] += counts[state]
        ranked.sort(key=lambda s: (-members[classes[s]], classes[s], -counts[s], s))
    data = cells.rarest(ranked, [*names, shown] if coded and shown else names)
    if shown and not coded:
        data[shown] = cells.mean(shown)
    ny, nx = dataset["label"].shape
    what = "the mean" if shown and not coded else "the rarest class"
    return cells.dataset(data), f"reduced from {nx} × {ny} cells: a pixel shows {what} of its cells"


def _cells(dataset: xr.Dataset, states: Mapping[State, int] | Sequence[State]) -> xr.Dataset:
    """A Dataset with one cell for each state, (states,): the integer variables with their attributes."""
    columns = np.array(list(states)).T
    names = [n for n in dataset.data_vars][: len(columns)]
    return xr.Dataset({n: ("state", v, dataset[n].attrs) for n, v in zip(names, columns, strict=True)})


@dataclass
class _Parts:
    """The parts of a map that are read one after another, and the blocks into which its cells are put."""

    source: xr.Dataset  # the map, with dims (y, x)
    block: Block  # sizes of a part along y and x
    convert: Convert  # applied to each part
    most: int  # most blocks along a side
    progress: bool  # show a progress bar for each pass over the map

    def read(self, names: Sequence[str]) -> Iterator[tuple[tuple[slice, ...], xr.Dataset]]:
        """The parts with these variables, and where they lie in the map."""
        with bar("cells" if self.progress else None, self.source["label"].size) as advance:
            for region, part in parts(self.source[list(names)], self.block):
                yield region, self.convert(part)
                advance(part[names[0]].size)

    def blocks(self, size: int) -> np.ndarray:
        """The numbers (size,) of the blocks in which the positions along a side lie."""
        return np.arange(size) * min(size, self.most) // size

    def counts(self, names: Sequence[str]) -> Counter[State]:
        """The number of cells in each state of these variables."""
        out: Counter[State] = Counter()
        for _, part in self.read(names):
            states, _, counts = _states(part, names)
            out.update(dict(zip(states, counts, strict=True)))
        return out

    def rarest(self, ranked: Sequence[State], names: Sequence[str]) -> dict[str, np.ndarray]:
        """The state of each block with the highest rank, as arrays (blocks along y, along x) by name; −1 without."""
        rank_of = {state: rank for rank, state in enumerate(ranked)}
        ranks = np.full(self._shape, -1)
        for region, part in self.read(names):
            states, which, _ = _states(part, names)
            rank = np.array([rank_of.get(state, -1) for state in states])[which]
            at, best = self._reduced(region, rank, np.maximum)
            ranks[at] = np.maximum(ranks[at], best)
        values = np.array([*ranked, (-1,) * len(names)]).T  # rank −1 is the last one
        return {n: v[ranks].astype(self.source[n].dtype) for n, v in zip(names, values, strict=True)}

    def mean(self, name: str) -> np.ndarray:
        """The mean (blocks along y, along x) of the finite values of the computed cells; NaN without any."""
        total, count = np.zeros((2, *self._shape))
        for region, part in self.read(["label", name]):
            values = part[name].values.astype(float)
            known = np.isfinite(values) & (part["label"].values > 0)
            for out, cells in ((total, np.where(known, values, 0.0)), (count, known.astype(float))):
                at, sums = self._reduced(region, cells, np.add)
                out[at] += sums
        return np.divide(total, count, out=np.full(self._shape, np.nan), where=count > 0)

    def dataset(self, data: Mapping[str, np.ndarray]) -> xr.Dataset:
        """The reduced map with these arrays, with the attributes of the map and its variables."""
        like = self.convert(self.source.isel(dict.fromkeys(self.block, slice(0, 1))))
        axes = self.convert(self.source.drop_vars(list(self.source.data_vars)))
        coords = {}
        for name in self.block:
            values, number = axes[name].values, self.blocks(axes.sizes[name])
            last = np.flatnonzero(np.diff(number, append=number[-1] + 1))
            first = np.append(0, last[:-1] + 1)
            coords[name] = (name, (values[first] + values[last]) / 2, axes[name].attrs)
        variables = {n: (tuple(self.block), v, like[n].attrs) for n, v in data.items()}
        return xr.Dataset(variables, coords, like.attrs)

    @property
    def _shape(self) -> tuple[int, ...]:
        """Number of blocks along y and x."""
        return tuple(min(n, self.most) for n in self.source["label"].shape)

    def _reduced(
        self, region: tuple[slice, ...], values: np.ndarray, combine: np.ufunc
    ) -> tuple[tuple[slice, ...], np.ndarray]:
        """The values (rows, columns) of a part, combined in each block that it meets; and where these blocks lie."""
        values, place = values.reshape([p.stop - p.start for p in region]), []
        for axis, (along, size) in enumerate(zip(region, self.source["label"].shape, strict=True)):
            number = self.blocks(size)[along]
            starts = np.flatnonzero(np.diff(number, prepend=-1))
            values = combine.reduceat(values, starts, axis=axis)
            place.append(slice(int(number[0]), int(number[-1]) + 1))
        return tuple(place), values


def _states(part: xr.Dataset, names: Sequence[str]) -> tuple[list[State], np.ndarray, list[int]]:
    """The different states of cells (N,), the state of each cell as an index (N,), and the number of cells of each."""
    columns = [part[n].values.ravel().astype(np.int64) for n in names]
    lows, spans = zip(*((int(c.min()), int(c.max() - c.min()) + 1) for c in columns), strict=True)
    code = np.zeros_like(columns[0])
    for column, low, span in zip(columns, lows, spans, strict=True):
        code = code * span + (column - low)
    if prod(spans) > max(_MOST_COUNTED, len(code)):
        codes, which, counts = np.unique(code, return_inverse=True, return_counts=True)
    else:  # counting is faster than sorting unless the codes are many
        every = np.bincount(code, minlength=prod(spans))
        codes, which, counts = np.flatnonzero(every), (np.cumsum(every > 0) - 1)[code], every[every > 0]
    values = []
    for low, span in zip(reversed(lows), reversed(spans), strict=True):
        codes, last = np.divmod(codes, span)
        values.append((last + low).tolist())
    return list(zip(*reversed(values), strict=True)), which, counts.tolist()
