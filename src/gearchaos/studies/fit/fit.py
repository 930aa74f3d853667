"""A fit: damping, backlash and transmission error of a gear pair from a measured order spectrum over the speed."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import MISSING, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from gearchaos.datasets import new_dataset, variables
from gearchaos.errors import InputError, unknown_name
from gearchaos.execute.progress import bar
from gearchaos.gears.io import units
from gearchaos.gears.io.measured_quantities import MEANING, MEASURED, MeasuredQuantity
from gearchaos.gears.io.order_spectrum import OrderSpectrum, read_order_spectrum
from gearchaos.gears.mesh.pair import GearPair
from gearchaos.gears.operation.operating import is_design
from gearchaos.model import vary
from gearchaos.quantities import POSITIVE, Rule
from gearchaos.studies.core.axis import Axis, at_axis_starts, check_speed_axes
from gearchaos.studies.core.declaration import function_of
from gearchaos.studies.core.options import option
from gearchaos.studies.core.study import WholeStudy
from gearchaos.studies.fit.fit_search import FitEnd, FitSearch, Varied
from gearchaos.studies.fit.fitted_motions import HISTORIES
from gearchaos.validation import check_rule

if TYPE_CHECKING:
    import xarray as xr

_SCREENED = 8  # points that are tried for each of which a search begins
_BELOW_WHOLE = Rule(lambda v: 0 < v < 1, "must be more than 0 % and less than 100 %")

@dataclass(frozen=True)
class Fit(WholeStudy):
    """Fit damping, backlash and transmission error of a gear pair to measured orders over the speed.

    The steady motions at all measured speeds are those of the exact flow. Where several motions are possible at a
    speed, from rest and after slow sweeps through the measured speeds, rising and falling, the one nearest to the
    measurement is taken, anew after each descent of the least squares, until the choice no longer changes.

    Returns
    -------
    xarray.Dataset
        Over ``varied`` ("damping_ratio", "backlash", "error1", ...): ``estimate`` with its 95 % interval
        ``estimate_lo`` to ``estimate_hi``, ``bound_lo`` and ``bound_hi``, in ``estimate_unit``, and
        ``not_identified``, the reason why there is no estimate, else empty. Over ``measurement``: ``speed``,
        ``order``, ``measured_amplitude``, ``computed_amplitude``, ``contact``, and ``history``, how the motion is
        reached: from "rest" where that fits as well, "rising", "falling", or "other". Over ``search``
        ``search_rms``, the root mean square of the weighted residuals where each search ended, least first.

    Raises
    ------
    InputError
        If the model is no single pair, or the file, a bound or the uncertainty cannot be read or is too little.

    Notes
    -----
    The damping ratio is k/(2 m ω0); phases of the error are kept. A residual is (computed − measured)/σ. A relative
    uncertainty is one of the mean of both, so that noise in proportion leaves no bias to its first order. Intervals are
    those of the linearised problem, s² (JᵀJ)⁻¹ and Student's t, within the bounds. s² is that of the residuals, at
    least 1 where an uncertainty is given. J is made of central differences on orbits that Newton's method has converged
    to rounding.

    Examples
    --------
    >>> import gearchaos as gc
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> pair = gc.GearPair(n1=25, n2=40, I1=4.88e-4, I2=3.2e-3, R1="35.24 mm", R2="56.38 mm", c0="400 N/um", chi1=0,
    ...     chi2=0, k="2000 N*s/m", backlash="0.12 mm", M10="85 N*m", speed=4000, error_amplitudes=["2 um"])
    >>> with TemporaryDirectory() as folder:
    ...     file = Path(folder) / "orders.csv"
    ...     _ = file.write_text("speed [rpm],order,amplitude [N]\\n4000,25,67\\n6000,25,169\\n9000,25,510\\n")
    ...     found = gc.fit(pair, str(file), ["error1=0.5:5 um"], starts=1)
    >>> float(found.estimate.round(2)[0]), found.estimate_unit.item()
    (2.0, 'um')

    As a value
    ----------
    >>> import gearchaos as gc
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> pair = gc.GearPair(n1=25, n2=40, I1=4.88e-4, I2=3.2e-3, R1="35.24 mm", R2="56.38 mm", c0="400 N/um", chi1=0,
    ...     chi2=0, k="2000 N*s/m", backlash="0.12 mm", M10="85 N*m", speed=4000, error_amplitudes=["2 um"])
    >>> with TemporaryDirectory() as folder:
    ...     file = Path(folder) / "orders.csv"
    ...     _ = file.write_text("speed [rpm],order,amplitude [N]\\n4000,25,67\\n6000,25,169\\n9000,25,510\\n")
    ...     study = gc.Fit(pair, str(file), ["error1=0.5:5 um"], starts=1)
    ...     study.kind, study.count
    ('fit', 1)
    """

    kind: ClassVar[str] = "fit"
    rank: ClassVar[int] = 5
    group: ClassVar[str] = "Gears"
    summary: ClassVar[str] = "fit"
    model_words: ClassVar[str] = "A single pair of given gears, with their torque."

    measured: str = option(
        MISSING, "A table of speed, order of wheel 1 and amplitude, rms or peak to peak, or such spectra, .uff.",
        keyword=False)
    vary: tuple[str, ...] = option(
        MISSING, "Parameters and their bounds: damping_ratio=0.02:0.15, backlash=0.05:0.25 mm, error1=1:20 um.",
        keyword=False)
    quantity: MeasuredQuantity = option("mesh force", f"What was measured. {MEANING}")
    uncertainty: str | None = option(
        None, 'Standard deviation of an amplitude: "5 %", or "2 N"; by default equal for all, and estimated.')
    starts: int = option(
        8, "Searches from a Sobol sequence within the bounds. Others begin beside the best of their ends.", least=1,
        most=1024)
    seed: int = option(0, "Of that sequence.", least=0)
    columns: Mapping[str, str] | None = option(
        None, "Headers in the file by the names of columns, with a unit where the file has none: "
        '{"amplitude": "Force [N]"}.', in_files=False)

    def __post_init__(self) -> None:
        self._set(measured=str(self.measured), vary=(self.vary,) if isinstance(self.vary, str) else tuple(self.vary))
        if not (isinstance(self._gears, GearPair) or is_design(self._gears)):
            raise InputError("model", "must be a GearPair or a GearDesign, or the model of one",
                             f"a {type(self._gears).__name__}",
                             "Of a train, give the pair whose mesh was measured, as [gearpair] or [design]; of a "
                             "design leave out faults, pitch errors and eccentricity.")
        if self.quantity not in MEASURED:
            raise unknown_name("quantity", str(self.quantity), MEASURED)
        speeds, count = self.spectrum.speeds, len(self.spectrum.amplitude)
        if len(speeds) < 2:
            raise InputError("measured", "must have two speeds or more", speeds.tolist(),
                             "What a fit finds is in how amplitudes change with the speed.")
        axis = Axis("speed", float(speeds[0]), float(speeds[-1]), 2)
        self._set(model=at_axis_starts(self.model, [axis]))
        super().__post_init__()
        check_speed_axes(self.model, [axis])
        vary(self.model, {"speed": speeds})
        self._set(model=self.model.with_values({"speed": axis.start}))
        names = [each.name for each in self.varied]
        if len(set(names)) < max(1, len(names)):
            raise InputError("vary", "must name one parameter or more, each once", names)
        if count <= len(names):
            raise InputError("measured", f"must have more amplitudes than the {len(names)} parameters", count,
                             "Measure at more speeds, or vary less.")
        own = self._gears.to_model(self.model.kind).parameters()
        if other := [n for n, v in self.model.parameters().items() if n != "omega" and own[n] != v]:
            raise InputError(other[0], "must be that of the gears", self.model.value(other[0]),
                             "Set it in the table of the gears, e.g. gearpair.k.")
        _ = self.weight

    @property
    def _gears(self) -> Any:
        """The gears of the model, which is also gears themselves while the study is created."""
        return getattr(self.model, "gears", self.model)

    @cached_property
    def spectrum(self) -> OrderSpectrum:
        """What was measured."""
        teeth = self._gears.n1 if isinstance(self._gears, GearPair) else self._gears.teeth[0]
        return read_order_spectrum(self.measured, self.quantity, teeth, self.columns)

    @cached_property
    def varied(self) -> tuple[Varied, ...]:
        """The parameters, with their bounds."""
        return tuple(map(Varied.parse, self.vary))

    @cached_property
    def weight(self) -> tuple[float, float]:
        """The relative and the absolute uncertainty, SI, one of which is 0."""
        if self.uncertainty is None:
            return 0.0, float(self.spectrum.amplitude.max()) or 1.0
        percent = re.fullmatch(r"\s*([\d.]+(?:[eE][-+]?\d+)?)\s*%\s*", str(self.uncertainty))
        if percent is None:
            try:
                dimension = MEASURED[self.quantity].dimension
                return 0.0, float(units.to_si("uncertainty", self.uncertainty, dimension, POSITIVE))
            except InputError:
                raise InputError("uncertainty", "must be a percentage, or a positive value with the unit of what was "
                                 "measured", self.uncertainty, "E.g. '5 %' or '2 N'.") from None
        check_rule("uncertainty", share := float(percent[1]) / 100, _BELOW_WHOLE, self.uncertainty)
        return share, 0.0

    @property
    def search(self) -> FitSearch:
        """The least squares."""
        return FitSearch(self._gears.to_pair(), self.model.kind, self.quantity, self.spectrum, self.varied, self.weight,
                      self.uncertainty is not None)

    def dataset(self, *, progress: bool = False, threads: int | None = None) -> xr.Dataset:
        from scipy.stats import qmc  # here, since it takes a third of a second to load

        search, ends = self.search, list[FitEnd]()
        points = qmc.Sobol(len(self.varied), rng=self.seed).random_base2((_SCREENED * self.starts - 1).bit_length())
        with bar("fit, searches" if progress else None, self.starts) as advance:
            for start in search.screened(points, self.starts):
                ends.append(search.run(start))
                advance(1)
        ends = search.with_neighbours(ends)
        low, high, reasons = search.intervals(ends)
        sizes = np.array([each.size for each in self.varied])
        known = np.where([not reason for reason in reasons], 1 / sizes, np.nan)
        ends_of = {"estimate": ends[0].x, "estimate_lo": low, "estimate_hi": high}
        data = variables(("varied",), {
            **{name: known * search.values(np.nan_to_num(x)) for name, x in ends_of.items()},
            "bound_lo": search.values(np.zeros(len(sizes))) / sizes,
            "bound_hi": search.values(np.ones(len(sizes))) / sizes,
            "estimate_unit": np.array([each.unit for each in self.varied]), "not_identified": np.array(reasons)})
        spectrum, (computed, contact) = self.spectrum, search.amplitudes(ends[0])
        data |= variables(("measurement",), {
            "speed": spectrum.speeds[spectrum.at], "order": spectrum.harmonic * float(search.pair.n1),
            "measured_amplitude": spectrum.amplitude / spectrum.size, "computed_amplitude": computed / spectrum.size,
            "contact": contact[spectrum.at].astype(np.int8),
            "history": np.array([*HISTORIES, "other"])[ends[0].history[spectrum.at]]})
        for name in ("measured_amplitude", "computed_amplitude"):
            data[name].attrs["units"] = spectrum.unit
        data |= variables(("search",), {"search_rms": np.sqrt([end.square / len(spectrum.at) for end in ends])})
        names = variables(("varied",), {"varied": np.array([each.name for each in self.varied])})
        settings = {n: getattr(self, n) for n in self.option_types()}
        return new_dataset(data, names, {**self.provenance(**settings), "ignored": self.spectrum.ignored})


fit = function_of(Fit)

