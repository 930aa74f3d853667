"""The public names for type checkers and editors; at run time ``__init__`` imports them on first use.

``python -m gearchaos.studies.generate`` writes this from the names there and from the classes of the studies.
"""

from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from typing import Literal

import xarray as xr

from gearchaos import dynamics as dynamics
from gearchaos import flow as flow
from gearchaos import plot as plot
from gearchaos import studies as studies
from gearchaos.cards.card import card as card
from gearchaos.continuation.orbit import Orbit
from gearchaos.continuation.orbit import orbit as orbit
from gearchaos.continuation.orbit import orbits as orbits
from gearchaos.continuation.saddles import EdgeState
from gearchaos.datasets import save as save
from gearchaos.dynamics.settings import Classification as Classification
from gearchaos.errors import InputError as InputError
from gearchaos.explorer.web.server import explore as explore
from gearchaos.gears.design.gear_design import GearDesign as GearDesign
from gearchaos.gears.operating import AnyModel
from gearchaos.gears.pair import GearPair as GearPair
from gearchaos.gears.results import physical as physical
from gearchaos.gears.train.mesh import Mesh as Mesh
from gearchaos.gears.train.parts import Body as Body
from gearchaos.gears.train.parts import Shaft as Shaft
from gearchaos.gears.train.planets import PlanetarySet as PlanetarySet
from gearchaos.gears.train.train import Train as Train
from gearchaos.interchange.scripts import script as script
from gearchaos.interchange.symbolic import SymbolicModel as SymbolicModel
from gearchaos.interchange.symbolic import from_sympy as from_sympy
from gearchaos.interchange.symbolic import to_sympy as to_sympy
from gearchaos.model import HarmonicStiffness as HarmonicStiffness
from gearchaos.model import MeshModel as MeshModel
from gearchaos.model import SteppedStiffness as SteppedStiffness
from gearchaos.model import ToothPairStiffness as ToothPairStiffness
from gearchaos.model import TransmissionError as TransmissionError
from gearchaos.model import TwoLevelStiffness as TwoLevelStiffness
from gearchaos.model.static import static_deflection as static_deflection
from gearchaos.store.read import load as load
from gearchaos.store.run import Outcome as Outcome
from gearchaos.store.run import run as run
from gearchaos.studies.agreement import agreement as agreement
from gearchaos.studies.assess import assess as assess
from gearchaos.studies.attractors import Attractors as _Attractors
from gearchaos.studies.axis import Axis as Axis
from gearchaos.studies.basins import Basins as _Basins
from gearchaos.studies.bifurcation import Bifurcation as _Bifurcation
from gearchaos.studies.branch import Branch as _Branch
from gearchaos.studies.chaos_proof import prove_chaos as prove_chaos
from gearchaos.studies.curve import Curve as _Curve
from gearchaos.studies.fit import Fit as _Fit
from gearchaos.studies.natural_frequencies import natural_frequencies as natural_frequencies
from gearchaos.studies.orders import Orders as _Orders
from gearchaos.studies.proofs import prove as prove
from gearchaos.studies.proofs import prove_box as prove_box
from gearchaos.studies.proofs import prove_event as prove_event
from gearchaos.studies.rattle import Rattle as _Rattle
from gearchaos.studies.regime import Regime as _Regime
from gearchaos.studies.regime import Verdict as Verdict
from gearchaos.studies.regime import steady as steady
from gearchaos.studies.runup import RunUp as _RunUp
from gearchaos.studies.saddles import EdgeTracking as _EdgeTracking
from gearchaos.studies.saddles import Manifolds as _Manifolds
from gearchaos.studies.scatter import Scatter as _Scatter
from gearchaos.studies.simulate import Simulate as _Simulate
from gearchaos.studies.skeleton import Skeleton as _Skeleton
from gearchaos.studies.speed_and_torque import dynamic_factor as dynamic_factor
from gearchaos.studies.speed_and_torque import operating_map as operating_map
from gearchaos.studies.speeds_to_avoid import speeds_to_avoid as speeds_to_avoid
from gearchaos.studies.zones import Zones as _Zones
from gearchaos.studyfile.loading import open as open

__version__: str

def simulate(
    model: AnyModel, periods: int, transient: int = 0, samples: int | None = None, *, progress: bool = False,
) -> xr.Dataset:
    """Integrate one motion: its stroboscopic section, one state per mesh period, and samples in time.

    Parameters
    ----------
    model : MeshModel, GearPair, GearDesign or Train
        The operating point, with its initial values.
    periods : int
        Mesh periods to record.
    transient : int
        Mesh periods before the recorded ones.
    samples : int, optional
        Instants recorded in each mesh period, at equal distances. By default only the stroboscopic section is
        recorded.
    progress : bool
        Show progress on stderr, and tell a long computing time before the work.

    Returns
    -------
    xarray.Dataset
        ``section_<coordinate>(period)`` at τ = T, 2T, ... after the transient; with ``samples`` also the coordinates,
        ``mesh_force`` 2ζz' + χ f(z), whose damping part acts by the damping law, and ``contact`` (-1 back flank, 0
        free, 1 front flank) over ``tau``.

        The attribute ``status`` is "ok", "diverged" if |z| or |z'| exceeded 1e8 half backlashes (from there on values
        are NaN), or "chatter" if a step had more contact switches than can be followed.

    Raises
    ------
    InputError
        If a number is out of range, or the computation needs more memory than this machine has.

    Examples
    --------
    >>> import gearchaos as gc
    >>> motion = gc.simulate(gc.MeshModel.of(q0=0.1, eps1=0.1), periods=4, transient=200, samples=32)
    >>> motion.section_z.shape, motion.z.shape, motion.attrs["status"]
    ((4,), (128,), 'ok')
    """

class Simulate(_Simulate):
    """The study that `simulate` runs.

    As a value it can be kept, and given to `gearchaos.run`: this computes it in memory or into a store.
    `simulate` says what it finds.

    Parameters
    ----------
    model : MeshModel, GearPair, GearDesign or Train
        The operating point, with its initial values.
    periods : int
        Mesh periods to record.
    transient : int
        Mesh periods before the recorded ones.
    samples : int, optional
        Instants recorded in each mesh period, at equal distances. By default only the stroboscopic section is
        recorded.

    Raises
    ------
    InputError
        If a field breaks a rule; before any work.

    Examples
    --------
    >>> import gearchaos as gc
    >>> study = gc.Simulate(gc.MeshModel.of(q0=0.1, eps1=0.1), periods=4)
    >>> study.kind, study.count
    ('simulate', 1)
    """

    def __init__(
        self, model: AnyModel, periods: int, transient: int = 0, samples: int | None = None,
    ) -> None: ...

def regime(
    model: AnyModel, *, settings: Classification | None = None, progress: bool = False,
) -> Verdict:
    """Classify the motion at one operating point, with its evidence.

    Parameters
    ----------
    model : MeshModel, GearPair, GearDesign or Train
        The operating point, with its initial values.
    settings : Classification, optional
        Lengths of the runs by which motions are classified.
    progress : bool
        Show progress on stderr, and tell a long computing time before the work.

    Returns
    -------
    Verdict
        With the ``label``, the ``reason``, the ``multipliers`` of the orbit, all ``lyapunov`` exponents of the dynamic
        state with their intervals, the response measures, and the stroboscopic ``section``.

    Raises
    ------
    InputError
        If the model or the settings are of another type, or the motion cannot be computed in a reasonable time; before
        any work.

    Examples
    --------
    >>> import gearchaos as gc
    >>> verdict = gc.regime(gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.206))
    >>> verdict.label, verdict.reason
    ('8T', 'a stable periodic orbit converged and the trajectory approaches it')
    """

class Regime(_Regime):
    """The study that `regime` runs.

    As a value it can be kept, and given to `gearchaos.run`: this computes it in memory or into a store.
    `regime` says what it finds.

    Parameters
    ----------
    model : MeshModel, GearPair, GearDesign or Train
        The operating point, with its initial values.
    settings : Classification, optional
        Lengths of the runs by which motions are classified.

    Raises
    ------
    InputError
        If a field breaks a rule; before any work.

    Examples
    --------
    >>> import gearchaos as gc
    >>> study = gc.Regime(gc.MeshModel.of(q0=0.1, eps1=0.1))
    >>> study.kind, study.count
    ('regime', 1)
    """

    def __init__(
        self, model: AnyModel, *, settings: Classification | None = None,
    ) -> None: ...

def attractors(
    model: AnyModel, starts: int = 256, *, box: Mapping[str, tuple[float, float]] | None = None, seed: int = 0, sweep:
    Axis | str | None = None, kicks: int = 0, settings: Classification | None = None, progress: bool = False, threads:
    int | None = None,
) -> xr.Dataset:
    """Find all attractors of one operating point, with the share of the initial states that lead to each.

    Its work items are the initial states, here called starts; sweeps and perturbations are computed by `finish`.

    Parameters
    ----------
    model : MeshModel, GearPair, GearDesign or Train
        The operating point. Initial values without a range in ``box`` are those of the model.
    starts : int
        Number of initial states, points of a scrambled Sobol sequence in the box.
    box : mapping of str to (float, float), optional
        Ranges of initial values; by default ±3 half backlashes, and ±2 for velocities, in every coordinate on which
        the relative motion depends.
    seed : int
        Seed of the Sobol sequence of initial states.
    sweep : Axis or str, optional
        A parameter that is also swept slowly to its value in the model, from both ends. It is swept upwards from
        the first value of the axis and downwards from the last, with ``count`` values in each sweep.
    kicks : int
        Directions in which to search the smallest perturbation that leaves a basin. They are random; the
        perturbation, here called kick, is searched for each attractor; by default it is not searched.
    settings : Classification, optional
        Lengths of the runs by which motions are classified.
    progress : bool
        Show progress on stderr, and tell a long computing time before the work.
    threads : int, optional
        Tiles computed at once; by default one per core.

    Returns
    -------
    xarray.Dataset
        For each attractor, along the dim "number": label, period, share of the initial states with its 95 % interval
        (Clopper-Pearson), response measures, largest exponent or multiplier, and section. ``attractor(start)`` is the
        number of the attractor that each initial state leads to, -1 for a motion that diverged or is undecided, -2 for
        one that an unfinished store does not have yet;
        ``attractor_up`` and ``attractor_down`` are those that the two sweeps end on. ``attractor_kick_change`` is the
        smallest sudden change of the state that was found after which a motion leaves the attractor,
        ``attractor_kick_point`` the state at the start of a mesh period to which it is added, and ``attractor_kick``
        its Euclidean norm in half backlashes and their velocities; NaN if no change up to 4 was found.

    Raises
    ------
    InputError
        If a number or a range is out of bounds; before any work.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(kind="single", omega=0.7, q0=0.1, eps1=0.05)
    >>> found = gc.attractors(model, starts=16)
    >>> gc.studies.motions(found.attractor_label, found.attractor_period)
    ['1T', '1T']
    """

class Attractors(_Attractors):
    """The study that `attractors` runs.

    As a value it can be kept, and given to `gearchaos.run`: this computes it in memory or into a store.
    `attractors` says what it finds.

    Parameters
    ----------
    model : MeshModel, GearPair, GearDesign or Train
        The operating point. Initial values without a range in ``box`` are those of the model.
    starts : int
        Number of initial states, points of a scrambled Sobol sequence in the box.
    box : mapping of str to (float, float), optional
        Ranges of initial values; by default ±3 half backlashes, and ±2 for velocities, in every coordinate on which
        the relative motion depends.
    seed : int
        Seed of the Sobol sequence of initial states.
    sweep : Axis or str, optional
        A parameter that is also swept slowly to its value in the model, from both ends. It is swept upwards from
        the first value of the axis and downwards from the last, with ``count`` values in each sweep.
    kicks : int
        Directions in which to search the smallest perturbation that leaves a basin. They are random; the
        perturbation, here called kick, is searched for each attractor; by default it is not searched.
    settings : Classification, optional
        Lengths of the runs by which motions are classified.

    Raises
    ------
    InputError
        If a field breaks a rule; before any work.

    Examples
    --------
    >>> import gearchaos as gc
    >>> study = gc.Attractors(gc.MeshModel.of(q0=0.1, eps1=0.1), starts=16)
    >>> study.kind, study.count
    ('attractors', 16)
    """

    def __init__(
        self, model: AnyModel, starts: int = 256, *, box: Mapping[str, tuple[float, float]] | None = None, seed: int =
        0, sweep: Axis | str | None = None, kicks: int = 0, settings: Classification | None = None,
    ) -> None: ...

def bifurcation(
    model: AnyModel, axis: Axis | str, *, points: int = 128, mode: Literal["fixed", "up", "down"] = 'fixed', settings:
    Classification | None = None, progress: bool = False, threads: int | None = None,
) -> xr.Dataset:
    """Scan one parameter: stroboscopic points, verdicts and exponents.

    Parameters
    ----------
    model : MeshModel, GearPair, GearDesign or Train
        All parameters but those of the axes, and the initial values.
    axis : Axis or str
        The parameter and its range, as a text "eps1=0:0.3:400".
    points : int
        Stroboscopic points per column, 0 for the verdicts alone.
    mode : {"fixed", "up", "down"}
        Columns from the model's initial values, or a sweep up or down. In a sweep each column starts from the state
        that the previous one ended in, as in a slow sweep of the parameter; both directions together show
        hysteresis.
    settings : Classification, optional
        Lengths of the runs by which motions are classified.
    progress : bool
        Show progress on stderr, and tell a long computing time before the work.
    threads : int, optional
        Tiles computed at once; by default one per core.

    Returns
    -------
    xarray.Dataset
        ``section_<coordinate>(axis, point)``, and for each column the variables that `zones` has for a cell.

    Raises
    ------
    InputError
        If the axis or an option is wrong, or the computation needs more memory than this machine has.

    Examples
    --------
    >>> import gearchaos as gc
    >>> diagram = gc.bifurcation(gc.MeshModel.of(q0=0.1), "eps1=0.1:0.2:3", points=8)
    >>> diagram.section_x1.shape
    (3, 8)
    >>> gc.studies.motions(diagram.label, diagram.period)
    ['2T', 'chaotic', 'chaotic']
    """

class Bifurcation(_Bifurcation):
    """The study that `bifurcation` runs.

    As a value it can be kept, and given to `gearchaos.run`: this computes it in memory or into a store.
    `bifurcation` says what it finds.

    Parameters
    ----------
    model : MeshModel, GearPair, GearDesign or Train
        All parameters but those of the axes, and the initial values.
    axis : Axis or str
        The parameter and its range, as a text "eps1=0:0.3:400".
    points : int
        Stroboscopic points per column, 0 for the verdicts alone.
    mode : {"fixed", "up", "down"}
        Columns from the model's initial values, or a sweep up or down. In a sweep each column starts from the state
        that the previous one ended in, as in a slow sweep of the parameter; both directions together show
        hysteresis.
    settings : Classification, optional
        Lengths of the runs by which motions are classified.

    Raises
    ------
    InputError
        If a field breaks a rule; before any work.

    Examples
    --------
    >>> import gearchaos as gc
    >>> study = gc.Bifurcation(gc.MeshModel.of(q0=0.1, eps1=0.1), "eps1=0.1:0.2:5")
    >>> study.kind, study.count
    ('bifurcation', 5)
    """

    def __init__(
        self, model: AnyModel, axis: Axis | str, *, points: int = 128, mode: Literal["fixed", "up", "down"] = 'fixed',
        settings: Classification | None = None,
    ) -> None: ...

def rattle(
    model: AnyModel, axis: Axis | str, *, mesh: str | None = None, settings: Classification | None = None,
) -> xr.Dataset:
    """Scan a train for rattle: where its meshes lose contact, their impacts, and the drag that stops them.

    Parameters
    ----------
    model : MeshModel, GearPair, GearDesign or Train
        It must be a train.
    axis : Axis or str
        A speed or a drag torque and its range, as a text "loose.torque=-0.4:-0.02:39".
    mesh : str, optional
        The mesh whose onset is looked for; by default all.
    settings : Classification, optional
        Lengths of the runs by which motions are classified.

    Returns
    -------
    xarray.Dataset
        Over ``history`` (from rest, and after slow sweeps of the axis, rising and falling), the axis and ``mesh``:
        ``mesh_contact``, ``mesh_front_share``, ``mesh_back_share``, ``mesh_impacts``, ``mesh_impulse``,
        ``mesh_peak_force``, ``mesh_rms_force`` and ``mesh_force_deviation``, its standard deviation; ``label`` and
        ``period`` of the motion. Over the axis and ``mesh`` ``excitation_ratio``, the largest fall of the linear
        deflection below its mean over that mean: contact is lost where it exceeds 1. Over ``onset`` the values of the
        axis at which the contact of a mesh from rest changes, ``onset_value``, with ``onset_mesh``, and
        ``onset_linear``, where the linear deflection vanishes; NaN if the stiffness of a mesh varies.

    Raises
    ------
    InputError
        If the model is no train, or the axis or a name is wrong.

    Notes
    -----
    Without play and with constant stiffness a train is linear. For one wheel under one order, with m = J/r_b², the
    fall of its spring force is r_b m r_a α k/|k − m w² + i c w| over the drag torque. At low speed it is the ratio of
    inertia to drag by which the literature judges rattle: contact is lost where J α r_a/r_b exceeds the drag
    (R. Singh, H. Xie, R. J. Comparin, *Analysis of automotive neutral gear rattle*, J. Sound Vib. 131 (1989) 177).

    Examples
    --------
    >>> import gearchaos as gc
    >>> driver = gc.Body(name="driver", motion=[{"order": 2, "acceleration": "300 rad/s^2"}])
    >>> loose = gc.Body(name="loose", inertia="5e-4 kg*m^2", torque="-0.2 N*m")
    >>> mesh = gc.Mesh(between=("driver", "loose"), teeth=(20, 30), base_radii=("30 mm", "45 mm"),
    ...                stiffness="2e8 N/m", damping="60 N*s/m", backlash="0.12 mm")
    >>> train = gc.Train(speed="800 rpm", bodies=[driver, loose], meshes=[mesh])
    >>> found = gc.rattle(train, "loose.torque=-0.2:-0.05:4")
    >>> found.onset_value.values.round(6).tolist(), found.onset_linear.values.round(6).tolist()
    ([-0.100003], [-0.100003])
    """

class Rattle(_Rattle):
    """The study that `rattle` runs.

    As a value it can be kept, and given to `gearchaos.run`: this computes it in memory or into a store.
    `rattle` says what it finds.

    Parameters
    ----------
    model : MeshModel, GearPair, GearDesign or Train
        It must be a train.
    axis : Axis or str
        A speed or a drag torque and its range, as a text "loose.torque=-0.4:-0.02:39".
    mesh : str, optional
        The mesh whose onset is looked for; by default all.
    settings : Classification, optional
        Lengths of the runs by which motions are classified.

    Raises
    ------
    InputError
        If a field breaks a rule; before any work.

    Examples
    --------
    >>> import gearchaos as gc
    >>> driver = gc.Body(name="driver", motion=[{"order": 2, "acceleration": "300 rad/s^2"}])
    >>> loose = gc.Body(name="loose", inertia="5e-4 kg*m^2", torque="-0.2 N*m")
    >>> mesh = gc.Mesh(between=("driver", "loose"), teeth=(20, 30), base_radii=("30 mm", "45 mm"),
    ...                stiffness="2e8 N/m", damping="60 N*s/m", backlash="0.12 mm")
    >>> train = gc.Train(speed="800 rpm", bodies=[driver, loose], meshes=[mesh])
    >>> study = gc.Rattle(train, "loose.torque=-0.2:-0.12:2")
    >>> study.kind, study.count
    ('rattle', 1)
    """

    def __init__(
        self, model: AnyModel, axis: Axis | str, *, mesh: str | None = None, settings: Classification | None = None,
    ) -> None: ...

def fit(
    model: AnyModel, measured: str, vary: tuple[str, ...], *, quantity: Literal["mesh force", "deflection",
    "transmission error", "acceleration"] = 'mesh force', uncertainty: str | None = None, starts: int = 8, seed: int =
    0, columns: Mapping[str, str] | None = None,
) -> xr.Dataset:
    """Fit damping, backlash and transmission error of a gear pair to a measured orders over the speed.

    The steady motions at all measured speeds are those of the exact flow. Where several motions are possible at a
    speed, from rest and after slow sweeps through the measured speeds, rising and falling, the one nearest to the
    measurement is taken, anew after each descent of the least squares, until the choice no longer changes.

    Parameters
    ----------
    model : MeshModel, GearPair, GearDesign or Train
        A single pair of given gears, with their torque.
    measured : str
        A table of speed, order of wheel 1 and amplitude, rms or peak to peak, or such spectra, .uff.
    vary : (str, ...)
        Parameters and their bounds: damping_ratio=0.02:0.15, backlash=0.05:0.25 mm, error1=1:20 um.
    quantity : {"mesh force", "deflection", "transmission error", "acceleration"}
        What was measured. The deflection is that of the mesh, the transmission error R1 φ1 − R2 φ2, both along the
        line of action; the acceleration is that of the latter.
    uncertainty : str, optional
        Standard deviation of an amplitude: "5 %", or "2 N"; by default equal for all, and estimated.
    starts : int
        Searches from a Sobol sequence within the bounds. Others begin beside the best of their ends.
    seed : int
        Of that sequence.
    columns : mapping of str to str, optional
        Headers in the file by the names of columns, with a unit where the file has none: {"amplitude": "Force
        [N]"}.

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
    uncertainty is one of the mean of both, so that noise in proportion leaves no bias to its first order. Intervals
    are those of the linearised problem, s² (JᵀJ)⁻¹ and Student's t, with s² from the residuals, at least 1 where an
    uncertainty is given, within the bounds. J is made of central
    differences on orbits that Newton's method has converged to rounding.

    Examples
    --------
    >>> import gearchaos as gc
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> pair = gc.GearPair(n1=25, n2=40, I1=4.88e-4, I2=3.2e-3, R1="35.24 mm", R2="56.38 mm", c0="400 N/um", chi1=0,
    ...     chi2=0, k="2000 N*s/m", backlash="0.12 mm", M10="85 N*m", speed=4000, error_amplitudes=["2 um"])
    >>> with TemporaryDirectory() as folder:
    ...     file = Path(folder) / "orders.csv"
    ...     _ = file.write_text("speed [rpm],order,amplitude [N]\n4000,25,67\n6000,25,169\n9000,25,510\n")
    ...     found = gc.fit(pair, str(file), ["error1=0.5:5 um"], starts=1)
    >>> float(found.estimate.round(2)[0]), found.estimate_unit.item()
    (2.0, 'um')
    """

class Fit(_Fit):
    """The study that `fit` runs.

    As a value it can be kept, and given to `gearchaos.run`: this computes it in memory or into a store.
    `fit` says what it finds.

    Parameters
    ----------
    model : MeshModel, GearPair, GearDesign or Train
        A single pair of given gears, with their torque.
    measured : str
        A table of speed, order of wheel 1 and amplitude, rms or peak to peak, or such spectra, .uff.
    vary : (str, ...)
        Parameters and their bounds: damping_ratio=0.02:0.15, backlash=0.05:0.25 mm, error1=1:20 um.
    quantity : {"mesh force", "deflection", "transmission error", "acceleration"}
        What was measured. The deflection is that of the mesh, the transmission error R1 φ1 − R2 φ2, both along the
        line of action; the acceleration is that of the latter.
    uncertainty : str, optional
        Standard deviation of an amplitude: "5 %", or "2 N"; by default equal for all, and estimated.
    starts : int
        Searches from a Sobol sequence within the bounds. Others begin beside the best of their ends.
    seed : int
        Of that sequence.
    columns : mapping of str to str, optional
        Headers in the file by the names of columns, with a unit where the file has none: {"amplitude": "Force
        [N]"}.

    Raises
    ------
    InputError
        If a field breaks a rule; before any work.

    Examples
    --------
    >>> import gearchaos as gc
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> pair = gc.GearPair(n1=25, n2=40, I1=4.88e-4, I2=3.2e-3, R1="35.24 mm", R2="56.38 mm", c0="400 N/um", chi1=0,
    ...     chi2=0, k="2000 N*s/m", backlash="0.12 mm", M10="85 N*m", speed=4000, error_amplitudes=["2 um"])
    >>> with TemporaryDirectory() as folder:
    ...     file = Path(folder) / "orders.csv"
    ...     _ = file.write_text("speed [rpm],order,amplitude [N]\n4000,25,67\n6000,25,169\n9000,25,510\n")
    ...     study = gc.Fit(pair, str(file), ["error1=0.5:5 um"], starts=1)
    ...     study.kind, study.count
    ('fit', 1)
    """

    def __init__(
        self, model: AnyModel, measured: str, vary: tuple[str, ...], *, quantity: Literal["mesh force", "deflection",
        "transmission error", "acceleration"] = 'mesh force', uncertainty: str | None = None, starts: int = 8, seed: int
        = 0, columns: Mapping[str, str] | None = None,
    ) -> None: ...

def orders(
    model: AnyModel, *, mesh: str | None = None, samples: int = 64, quantity: Literal["mesh force", "deflection",
    "transmission error", "acceleration"] = 'mesh force', rms: bool = False, against: MeshModel | None = None, settings:
    Classification | None = None,
) -> xr.Dataset:
    """Compute the order spectrum of a steady motion, its lines named by mesh harmonics and sidebands.

    The motion is that reached from rest, or from the initial values of the gears, as `regime` classifies it. If it
    repeats, its window does with it, and the lines are exact, those of a force by the motion of the bodies. Otherwise
    they are root mean squares over Hann windows of two turns of the first wheel.

    Parameters
    ----------
    model : MeshModel, GearPair, GearDesign or Train
        Given gears, with their speed and torque.
    mesh : str, optional
        Of a train, the mesh that is looked at; by default the first.
    samples : int
        Instants of each mesh period at which it is taken for its spectrum.
    quantity : {"mesh force", "deflection", "transmission error", "acceleration"}
        What the spectrum is of. The deflection is that of the mesh, the transmission error R1 φ1 − R2 φ2, both
        along the line of action; the acceleration is that of the latter.
    rms : bool
        Root mean squares of the lines instead of their peaks.
    against : MeshModel, optional
        Gears of the same teeth and speed, of which the spectrum is given as well.
    settings : Classification, optional
        Lengths of the runs by which motions are classified.

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
    """

class Orders(_Orders):
    """The study that `orders` runs.

    As a value it can be kept, and given to `gearchaos.run`: this computes it in memory or into a store.
    `orders` says what it finds.

    Parameters
    ----------
    model : MeshModel, GearPair, GearDesign or Train
        Given gears, with their speed and torque.
    mesh : str, optional
        Of a train, the mesh that is looked at; by default the first.
    samples : int
        Instants of each mesh period at which it is taken for its spectrum.
    quantity : {"mesh force", "deflection", "transmission error", "acceleration"}
        What the spectrum is of. The deflection is that of the mesh, the transmission error R1 φ1 − R2 φ2, both
        along the line of action; the acceleration is that of the latter.
    rms : bool
        Root mean squares of the lines instead of their peaks.
    against : MeshModel, optional
        Gears of the same teeth and speed, of which the spectrum is given as well.
    settings : Classification, optional
        Lengths of the runs by which motions are classified.

    Raises
    ------
    InputError
        If a field breaks a rule; before any work.

    Examples
    --------
    >>> import gearchaos as gc
    >>> pair = gc.GearPair(n1=25, n2=40, I1=4.88e-4, I2=3.2e-3, R1=0.03524, R2=0.05638, c0=4e8, k=2000.0,
    ...                    backlash=1.2e-4, M10=85.0, speed=4000.0, error_amplitudes=[2e-6])
    >>> study = gc.Orders(pair, quantity="deflection")
    >>> study.kind, study.count
    ('orders', 1)
    """

    def __init__(
        self, model: AnyModel, *, mesh: str | None = None, samples: int = 64, quantity: Literal["mesh force",
        "deflection", "transmission error", "acceleration"] = 'mesh force', rms: bool = False, against: MeshModel | None
        = None, settings: Classification | None = None,
    ) -> None: ...

def runup(
    model: AnyModel, speed: Axis | str, duration: float = 60.0, *, mesh: str | None = None, samples: int = 64, down:
    bool = False, torque: str | Mapping[str, Sequence[float]] | None = None, events: bool = False, signal: bool = False,
    journal: str | PathLike[str] | None = None,
) -> xr.Dataset:
    """Run gears up through a range of speeds, and down again: response, jumps, orders of the mesh force.

    The speed changes linearly with time. It is constant within a mesh period, of a train within its common period, and
    such that these begin when they do at the speed that changes continuously. So is a torque that changes: it is that
    at the middle of the period. From one to the next the positions and the velocities of the wheels stay. Within a
    period the flow is exact. The run begins with the motion that is reached from rest at the first speed and torque; a
    run-down goes on with the motion of the run-up.

    Parameters
    ----------
    model : MeshModel, GearPair, GearDesign or Train
        Given gears, with their torque.
    speed : Axis or str
        The first and the last speed, as a text "speed=500:6000" in rpm.
    duration : float
        Of the run-up, in s.
    mesh : str, optional
        Of a train, the mesh that is looked at; by default the first.
    samples : int
        Instants of each mesh period at which it is taken for its spectrum.
    down : bool
        Run down again as well, in the same time.
    torque : str | mapping of str to Sequence[float], optional
        A table of the torque over time or speed, linear between rows. It is a file whose header has the units, or
        the columns in s, rpm and N m. It replaces the torque of the gears; of a train all mean torques change in
        one ratio. Gears are made for 4000 steps from the least to the largest torque.
    events : bool
        Find the event that ends the branch of the motion before each jump.
    signal : bool
        Also give the mesh force and the speed over the time.
    journal : str | PathLike[str], optional
        A file that keeps what is computed. If it exists, the same call goes on from there, to the same result.

    Returns
    -------
    xarray.Dataset
        Over ``direction`` ("up", and with ``down`` also "down") and ``speed``: ``dynamic_factor``, the largest mesh
        force over the static one; ``mesh_force_peak``, ``contact`` and ``z_peak_to_peak``, the worst in any period.
        Over ``order`` too ``order_force``, the amplitude of the mesh force at the orders of the turn of the first
        wheel, the root mean square over windows of two turns, of a train of as many as its periods need. Over ``jump``
        ``speed_of_jump``, ``direction_of_jump``, ``factor_before_jump`` and ``factor_after_jump``: where the range of
        the mesh force in a period suddenly changes by a quarter or more, and is steady before or after; ``clear_jump``,
        whether it is both. With ``events`` also ``event_kind`` and ``event_speed``: the event that ends the branch of
        the motion before the jump, followed over the speed at the torque there; the speed is NaN where there is none,
        and the kind says why. With ``signal`` also ``signal_time``, s, ``signal_force`` and ``signal_speed``, rpm, over
        ``direction`` and ``instant``, of each mesh period ``samples`` instants; what rings faster is filtered out of
        the force. With ``torque`` also this over ``direction`` and ``speed``. The static force is that at the speed and
        the torque of each period; without torque the dynamic factor is NaN.

        Of a train they are those of one mesh, which the coordinate ``mesh`` names. The attribute ``status`` is "ok", or
        says at what speed the motion diverged; ``mesh_order`` is the order of the mesh.

    Raises
    ------
    InputError
        If the gears are not known, the speed changes by more than 5 % within a period, the torque is not given for the
        whole run, or the journal is one of another run-up.

    Examples
    --------
    >>> import gearchaos as gc
    >>> design = gc.GearDesign(
    ...     teeth=(50, 50), module="3 mm", face_width="20 mm", bore="30 mm", damping_ratio=0.05, torque="150 N*m",
    ...     backlash={"value": "0.12 mm", "of": "line of action, total"}, transmission_error="from quality",
    ...     quality={"standard": "ISO 1328-1:1995", "grade": 6})
    >>> found = gc.runup(design.at(speed=500), "speed=500:900", 1.0)
    >>> found.order_force.dims, found.attrs["status"]
    (('direction', 'speed', 'order'), 'ok')
    """

class RunUp(_RunUp):
    """The study that `runup` runs.

    As a value it can be kept, and given to `gearchaos.run`: this computes it in memory or into a store.
    `runup` says what it finds.

    Parameters
    ----------
    model : MeshModel, GearPair, GearDesign or Train
        Given gears, with their torque.
    speed : Axis or str
        The first and the last speed, as a text "speed=500:6000" in rpm.
    duration : float
        Of the run-up, in s.
    mesh : str, optional
        Of a train, the mesh that is looked at; by default the first.
    samples : int
        Instants of each mesh period at which it is taken for its spectrum.
    down : bool
        Run down again as well, in the same time.
    torque : str | mapping of str to Sequence[float], optional
        A table of the torque over time or speed, linear between rows. It is a file whose header has the units, or
        the columns in s, rpm and N m. It replaces the torque of the gears; of a train all mean torques change in
        one ratio. Gears are made for 4000 steps from the least to the largest torque.
    events : bool
        Find the event that ends the branch of the motion before each jump.
    signal : bool
        Also give the mesh force and the speed over the time.

    Raises
    ------
    InputError
        If a field breaks a rule; before any work.

    Examples
    --------
    >>> import gearchaos as gc
    >>> design = gc.GearDesign(
    ...     teeth=(50, 50), module="3 mm", face_width="20 mm", bore="30 mm", damping_ratio=0.05, torque="150 N*m",
    ...     backlash={"value": "0.12 mm", "of": "line of action, total"}, transmission_error="from quality",
    ...     quality={"standard": "ISO 1328-1:1995", "grade": 6})
    >>> study = gc.RunUp(design.at(speed=500), "speed=500:900", 1.0, down=True)
    >>> study.kind, study.count
    ('runup', 1)
    """

    def __init__(
        self, model: AnyModel, speed: Axis | str, duration: float = 60.0, *, mesh: str | None = None, samples: int = 64,
        down: bool = False, torque: str | Mapping[str, Sequence[float]] | None = None, events: bool = False, signal:
        bool = False,
    ) -> None: ...

def scatter(
    model: AnyModel, vary: tuple[str, ...], speed: Axis | str, torque: tuple[float, ...] | None = None, *, samples: int
    = 1024, factor: float = 1.5, indices: bool = True, start: Literal["rest", "static deflection", "steady contact"] =
    'rest', correlations: tuple[tuple[str, str, float], ...] = (), load_change: float | None = 1.0, wide: bool = False,
    seed: int = 0, budget: int = 2000000, settings: Classification | None = None, progress: bool = False, threads: int |
    None = None,
) -> xr.Dataset:
    """Say what the scatter of uncertain inputs does to contact loss and dynamic factor along the speed.

    Every sample is a design of its own, made anew with all that follows from its inputs. At each speed the motion from
    the initial state that ``start`` names is followed, and from the next speeds, rising and falling, motions that have
    lost contact there: these are those of operation. With ``load_change`` one more is followed at each speed, from a
    random state after a change of the load, as in `speeds_to_avoid`, or with ``wide`` from any of wide ranges.

    Parameters
    ----------
    model : MeshModel, GearPair, GearDesign or Train
        A single pair of given gears, or a dimensionless one.
    vary : (str, ...)
        Inputs with distributions: backlash=0.10:0.25 mm, damping_ratio=0.05±0.01, quality.grade=6:8.
    speed : Axis or str
        Speeds of wheel 1, rpm, as a text "speed=500:6000:60"; of a dimensionless model omega.
    torque : (float, ...), optional
        Torques at wheel 1, numbers in N m or texts; by default that of the gears.
    samples : int
        Designs from which probabilities follow, 16 times a power of two.
    factor : float
        Limit of the dynamic factor over the quasi-static ratio.
    indices : bool
        Also compute the indices of Sobol, from half as many designs again for each input.
    start : {"rest", "static deflection", "steady contact"}
        Initial states of the motions. From rest they are those of the model, of gears flanks that touch; in steady
        contact those of the motion of flanks that never part, at the mean stiffness.
    correlations : (tuple[str, str, float), ...]
        Of pairs of inputs, as [first, second, correlation]: a Gaussian copula.
    load_change : float, optional
        The load goes to -LAMBDA times itself and back: 1 reversal, 0 loss, -0.5 half. None, of commands and files
        "none", where the load never changes.
    wide : bool
        Look at wide ranges of states instead, which no load stores.
    seed : int
        Of the samples.
    budget : int
        Most motions that are followed.
    settings : Classification, optional
        Lengths of the runs by which motions are classified.
    progress : bool
        Show progress on stderr, and tell a long computing time before the work.
    threads : int, optional
        Tiles computed at once; by default one per core.

    Returns
    -------
    xarray.Dataset
        Over ``outcome``, ``torque`` and ``speed`` (``omega`` of a dimensionless model) ``probability`` with its 95 %
        interval, ``probability_lo`` to ``probability_hi``; outcomes are "contact loss", "both flanks hit", "no
        repetition" (chaotic or quasi-periodic), "force over limit": a dynamic factor, over the quasi-static ratio of
        the design, above ``factor``, and "beyond the teeth", of which no factor counts. ``anywhere``, ``anywhere_lo``,
        ``anywhere_hi`` are those of an outcome at any of the speeds. These are of operation; the same names with
        ``_after_load_change`` before ``_lo`` and ``_hi`` are those after one change of the load at each speed. Over
        ``torque`` and ``percentile`` (5, 50, 95) ``lowest_speed_lost``, ``highest_speed_lost`` of the designs that lose
        contact, and ``share_lost`` of the speeds. Over ``output``, ``torque`` and ``varied`` Sobol's indices
        ``first_index`` and ``total_index``; over ``aim``, ``torque`` and ``varied`` ``if_best``, what is expected where
        an input is held at its best value, from ``best_from`` to ``best_to``, and ``if_halved``, where its spread is
        halved; all with ``_lo`` and ``_hi``. Over ``varied`` ``distribution``, ``varied_unit`` and ``cut_share``.
        ``impossible`` is the share of designs that are not possible; the others are those that count. Over ``sample``
        the inputs and results of each design: ``sample_value``, ``sample_possible``, ``sample_share_lost``,
        ``sample_contact`` (the worst at any speed), ``sample_factor``.

    Raises
    ------
    InputError
        If an input cannot be varied, has impossible values, correlations do not go together, or more motions would be
        followed than ``budget``.

    Notes
    -----
    "quality.deviations=within the grade" stands for ``quality.deviations.1`` and ``quality.deviations.2``: the
    tooth-to-tooth deviations of both wheels, over those that the grade permits, of the error "from quality". They are
    normal, with the permissible ones at three standard deviations: a convention.

    Samples are 16 independent scramblings of a Sobol sequence; intervals follow from their scatter by Student's t with
    15 degrees of freedom. Indices are not defined for correlated inputs, nor where designs are not possible, since the
    inputs of the others then depend on each other. With indices half of the samples each are A and B of Saltelli's
    design, and half as many again are computed for each input. Motions that are called chaotic are not followed to
    see whether the chaos is transient.

    Examples
    --------
    >>> import gearchaos as gc
    >>> design = gc.GearDesign(
    ...     teeth=(50, 50), module="3 mm", face_width="20 mm", bore="30 mm", damping_ratio=0.05,
    ...     backlash={"value": "0.12 mm", "of": "line of action, total"}, transmission_error="from quality",
    ...     quality={"standard": "ISO 1328-1:1995", "grade": 6})
    >>> found = gc.scatter(design, ["damping_ratio=0.03:0.1"], "speed=1000:4000:4", [100], samples=64)
    >>> found.probability.dims
    ('outcome', 'torque', 'speed')
    """

class Scatter(_Scatter):
    """The study that `scatter` runs.

    As a value it can be kept, and given to `gearchaos.run`: this computes it in memory or into a store.
    `scatter` says what it finds.

    Parameters
    ----------
    model : MeshModel, GearPair, GearDesign or Train
        A single pair of given gears, or a dimensionless one.
    vary : (str, ...)
        Inputs with distributions: backlash=0.10:0.25 mm, damping_ratio=0.05±0.01, quality.grade=6:8.
    speed : Axis or str
        Speeds of wheel 1, rpm, as a text "speed=500:6000:60"; of a dimensionless model omega.
    torque : (float, ...), optional
        Torques at wheel 1, numbers in N m or texts; by default that of the gears.
    samples : int
        Designs from which probabilities follow, 16 times a power of two.
    factor : float
        Limit of the dynamic factor over the quasi-static ratio.
    indices : bool
        Also compute the indices of Sobol, from half as many designs again for each input.
    start : {"rest", "static deflection", "steady contact"}
        Initial states of the motions. From rest they are those of the model, of gears flanks that touch; in steady
        contact those of the motion of flanks that never part, at the mean stiffness.
    correlations : (tuple[str, str, float), ...]
        Of pairs of inputs, as [first, second, correlation]: a Gaussian copula.
    load_change : float, optional
        The load goes to -LAMBDA times itself and back: 1 reversal, 0 loss, -0.5 half. None, of commands and files
        "none", where the load never changes.
    wide : bool
        Look at wide ranges of states instead, which no load stores.
    seed : int
        Of the samples.
    budget : int
        Most motions that are followed.
    settings : Classification, optional
        Lengths of the runs by which motions are classified.

    Raises
    ------
    InputError
        If a field breaks a rule; before any work.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(kind="single", omega=0.8, q0=0.1, chi0=0, zeta=0.05, eps1=0.045)
    >>> study = gc.Scatter(model, ["eps1=0.045±0.005", "zeta=0.04:0.06"], "omega=0.7:0.9:3", samples=64)
    >>> study.kind, study.count
    ('scatter', 384)
    """

    def __init__(
        self, model: AnyModel, vary: tuple[str, ...], speed: Axis | str, torque: tuple[float, ...] | None = None, *,
        samples: int = 1024, factor: float = 1.5, indices: bool = True, start: Literal["rest", "static deflection",
        "steady contact"] = 'rest', correlations: tuple[tuple[str, str, float], ...] = (), load_change: float | None =
        1.0, wide: bool = False, seed: int = 0, budget: int = 2000000, settings: Classification | None = None,
    ) -> None: ...

def zones(
    model: AnyModel, x: Axis | str, y: Axis | str, *, starts: int = 1, load_change: float = 1.0, wide: bool = False,
    refine: int = 1, prove: bool = False, certificates: str | None = None, settings: Classification | None = None,
    progress: bool = False, threads: int | None = None,
) -> xr.Dataset:
    """Map the kinds of motion over two parameters.

    Parameters
    ----------
    model : MeshModel, GearPair, GearDesign or Train
        All parameters but the two of the axes; its initial values hold in every cell.
    x : Axis or str
        A parameter, or an initial value, and its range, as a text "omega=0.2:3:400".
    y : Axis or str
        Another one.
    starts : int
        Number of initial states in each cell, to find all its motions. They are those of the model, and others
        spread as by `attractors`, of given gears those after a load change. With more than one, the motions after
        slow sweeps along x, upwards and downwards, are also found.
    load_change : float
        The load goes to -LAMBDA times itself and back: 1 reversal, 0 loss, -0.5 half. The further initial states of
        given gears are those after it.
    wide : bool
        Of given gears too, look at wide ranges of states, which no load stores.
    refine : int
        Every N-th row and column; more cells only where neighbours differ. N is a power of two; the other cells are
        inferred, and marked by ``inferred`` and ``reason``. 1 computes every cell.
    prove : bool
        Prove the periodic motions in ball arithmetic. See `prove`; with more than one start, the motion from the
        initial values of the model is proved in each computed cell.
    certificates : str, optional
        Write a certificate for each proved cell to this folder. The files are ``row0003/column0012.json``, with the
        script that verifies them. It needs ``prove``.
    settings : Classification, optional
        Lengths of the runs by which motions are classified.
    progress : bool
        Show progress on stderr, and tell a long computing time before the work.
    threads : int, optional
        Tiles computed at once; by default one per core.

    Returns
    -------
    xarray.Dataset
        With dims (y.name, x.name): label, period, reason, largest Lyapunov exponent with its interval, residual and
        largest multiplier of the orbit, response measures, contact, periods spent. With more than one start also the
        number of ``attractors`` found in each cell, ``v_rms_least`` and ``v_rms_most`` among them, ``contact_worst``,
        ``v_rms_up`` and ``v_rms_down`` after the sweeps, and ``hysteresis``: 1 where the two sweeps end in different
        motions. Of given gears, unless ``wide``, then also ``to_avoid``, what happens where the teeth separate, in
        operation or after a load change alone, and ``share_of_load_changes``, after which they do, with its interval.
        With ``prove`` also ``proved``: 1 where the motion is proved, 0 where it is not, -1 where it is not
        periodic; and ``proof_reason``, why it is not proved. Inferred cells are not proved.

    Raises
    ------
    InputError
        If an axis or an option is wrong, or the computation needs more memory than this machine has.

    Examples
    --------
    >>> import gearchaos as gc
    >>> zones = gc.zones(gc.MeshModel.of(q0=0.1), "omega=0.5:1.5:24", "eps1=0:0.3:16")
    >>> zones.label.dims, zones.label.shape
    (('eps1', 'omega'), (16, 24))
    >>> zones.v_rms.attrs["units"]
    'delta*omega0'
    """

class Zones(_Zones):
    """The study that `zones` runs.

    As a value it can be kept, and given to `gearchaos.run`: this computes it in memory or into a store.
    `zones` says what it finds.

    Parameters
    ----------
    model : MeshModel, GearPair, GearDesign or Train
        All parameters but the two of the axes; its initial values hold in every cell.
    x : Axis or str
        A parameter, or an initial value, and its range, as a text "omega=0.2:3:400".
    y : Axis or str
        Another one.
    starts : int
        Number of initial states in each cell, to find all its motions. They are those of the model, and others
        spread as by `attractors`, of given gears those after a load change. With more than one, the motions after
        slow sweeps along x, upwards and downwards, are also found.
    load_change : float
        The load goes to -LAMBDA times itself and back: 1 reversal, 0 loss, -0.5 half. The further initial states of
        given gears are those after it.
    wide : bool
        Of given gears too, look at wide ranges of states, which no load stores.
    refine : int
        Every N-th row and column; more cells only where neighbours differ. N is a power of two; the other cells are
        inferred, and marked by ``inferred`` and ``reason``. 1 computes every cell.
    prove : bool
        Prove the periodic motions in ball arithmetic. See `prove`; with more than one start, the motion from the
        initial values of the model is proved in each computed cell.
    certificates : str, optional
        Write a certificate for each proved cell to this folder. The files are ``row0003/column0012.json``, with the
        script that verifies them. It needs ``prove``.
    settings : Classification, optional
        Lengths of the runs by which motions are classified.

    Raises
    ------
    InputError
        If a field breaks a rule; before any work.

    Examples
    --------
    >>> import gearchaos as gc
    >>> study = gc.Zones(gc.MeshModel.of(q0=0.1, eps1=0.1), "omega=0.9:1.1:4", "eps1=0.1:0.2:4")
    >>> study.kind, study.count
    ('zones', 16)
    """

    def __init__(
        self, model: AnyModel, x: Axis | str, y: Axis | str, *, starts: int = 1, load_change: float = 1.0, wide: bool =
        False, refine: int = 1, prove: bool = False, certificates: str | None = None, settings: Classification | None =
        None,
    ) -> None: ...

def basins(
    model: AnyModel, x: Axis | str, y: Axis | str, *, settings: Classification | None = None, progress: bool = False,
    threads: int | None = None,
) -> xr.Dataset:
    """Map the basins of attraction over two initial values.

    Parameters
    ----------
    model : MeshModel, GearPair, GearDesign or Train
        The operating point. Initial values that are not on the axes are those of the model.
    x : Axis or str
        Initial value of a coordinate, and its range: z or z_dot of the single model, x1, x1_dot, ... of the others.
    y : Axis or str
        Initial value of another one.
    settings : Classification, optional
        Lengths of the runs by which motions are classified.
    progress : bool
        Show progress on stderr, and tell a long computing time before the work.
    threads : int, optional
        Tiles computed at once; by default one per core.

    Returns
    -------
    xarray.Dataset
        ``attractor(y, x)``, an index into the dim "number", -1 where the motion diverged or is undecided, -2 where the
        cell is not computed yet. For each attractor: label, period, share of the plane, response measures, largest
        exponent or multiplier, and section. Periodic attractors are distinguished by their orbits, others by the mean
        and standard deviation of their stroboscopic points. ``basin_entropy``, ``boundary_basin_entropy`` and
        ``uncertainty_exponent`` measure how fractal the boundaries are. Where the plane is the whole state space (of a
        model with two coordinates) ``attractor_kick`` is the length of the smallest change of the state that leaves the
        basin.

    Raises
    ------
    InputError
        If an axis is no initial value of the model, or the computation needs more memory than this machine has.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(kind="single", omega=0.7, q0=0.1, eps1=0.05)
    >>> basins = gc.basins(model, "z=-2:2:20", "z_dot=-1:1:20")
    >>> basins.attractor.shape, basins.sizes["number"]
    ((20, 20), 2)
    """

class Basins(_Basins):
    """The study that `basins` runs.

    As a value it can be kept, and given to `gearchaos.run`: this computes it in memory or into a store.
    `basins` says what it finds.

    Parameters
    ----------
    model : MeshModel, GearPair, GearDesign or Train
        The operating point. Initial values that are not on the axes are those of the model.
    x : Axis or str
        Initial value of a coordinate, and its range: z or z_dot of the single model, x1, x1_dot, ... of the others.
    y : Axis or str
        Initial value of another one.
    settings : Classification, optional
        Lengths of the runs by which motions are classified.

    Raises
    ------
    InputError
        If a field breaks a rule; before any work.

    Examples
    --------
    >>> import gearchaos as gc
    >>> study = gc.Basins(gc.MeshModel.of(q0=0.1, eps1=0.1), "x1=-1:1:6", "x1_dot=-1:1:6")
    >>> study.kind, study.count
    ('basins', 36)
    """

    def __init__(
        self, model: AnyModel, x: Axis | str, y: Axis | str, *, settings: Classification | None = None,
    ) -> None: ...

def branch(
    model: AnyModel, axis: Axis | str, *, start: Mapping[str, float] | None = None, period: int | None = None,
    longest_step: float = 0.03, max_points: int = 10000, cascade: int = 0, pitchforks: bool = False, events:
    Mapping[str, Callable[[Orbit], float]] | None = None,
) -> xr.Dataset:
    """Follow a branch of periodic orbits along one parameter, stable or not, with all its events.

    It is followed in both directions.

    Parameters
    ----------
    model : MeshModel, GearPair, GearDesign or Train
        The branch begins at its own value of the parameter.
    axis : Axis or str
        The parameter and its range, "eps1=0:0.3"; a number of values is accepted and has no effect.
    start : mapping of str to float, optional
        Initial values near the first orbit; by default those of the model. If its own lead to a motion of another
        period, the orbit is found as by `orbit`.
    period : int, optional
        Minimal period; by default that of the motion that the start leads to. It counts mesh periods, at most 1024.
    longest_step : float
        Longest step. A step has length 1 if a parameter changes by its whole range, or if the root mean square
        distance of all stroboscopic points is half a backlash.
    max_points : int
        Largest number of points in each direction.
    cascade : int
        Period doublings to follow from the first flip. It is the flip at which stability first changes on leaving
        the start; of two such flips, one in each direction, that with the nearer parameter. There are none if
        stability first changes at other events.
    pitchforks : bool
        Follow both branches at each pitchfork. They are branches of asymmetric orbits.
    events : mapping of str to callable, optional
        Further kinds of events: each root, along the branch, of a function of the `Orbit` is an event of that name.

    Returns
    -------
    xarray.Dataset
        Over ``point``, in order along the branch: the parameter as a coordinate; ``position`` (0, 1, 2, …), ``branch``
        (0, and 1, 2, … for those of doubled period and then those at pitchforks), ``period``, ``unstable``,
        ``multipliers_real`` and ``multipliers_imag`` (point, exponent),
        ``section_<coordinate>`` (point, cycle), ``contact_sequence``, the response measures over one period of the
        orbit, ``z_max``, ``z_min``, ``residual`` and ``step``. Over ``event``: ``event_kind``, ``event_value``,
        ``event_period``, ``event_boundary``, ``event_residual``, ``event_branch``, ``event_point``, and multipliers,
        one state ``event_section_<coordinate>`` and the response measures with the prefix ``event_``. Over
        ``jump``, the folds that end a stable part: ``jump_value``, ``jump_direction`` (1 or −1), ``jump_event``, and of
        the motion reached just beyond ``jump_label``, ``jump_period`` and ``jump_point``. The attributes
        ``closed``, ``range``, ``ends``, ``stable``, ``cascade``, ``asymmetric`` and ``feigenbaum`` are JSON.

    Raises
    ------
    InputError
        If an argument is out of range, the model's own value lies outside the axis, or there is no orbit of this period
        near the start; the message then has the nearest one found.

    Notes
    -----
    Pseudo-arclength continuation of all stroboscopic points (multiple shooting). Events are located by bracketing on
    corrected orbits: folds, flips, Neimark-Sacker points, branch points (``pitchfork``), neutral saddles and grazes;
    with the damping law ``unilateral`` border collisions in place of grazes. There contact may also end anew while z is
    beyond the boundary, which is no event.
    The branch ends at an end of the axis, where it joins one of half its period, where the flow fails, or at its own
    start: then it is closed, an isola.

    Examples
    --------
    >>> import gearchaos as gc
    >>> found = gc.branch(gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.206), "eps1=0:0.3")
    >>> found.event_kind.values.tolist()
    ['fold', 'flip']
    """

class Branch(_Branch):
    """The study that `branch` runs.

    As a value it can be kept, and given to `gearchaos.run`: this computes it in memory or into a store.
    `branch` says what it finds.

    Parameters
    ----------
    model : MeshModel, GearPair, GearDesign or Train
        The branch begins at its own value of the parameter.
    axis : Axis or str
        The parameter and its range, "eps1=0:0.3"; a number of values is accepted and has no effect.
    start : mapping of str to float, optional
        Initial values near the first orbit; by default those of the model. If its own lead to a motion of another
        period, the orbit is found as by `orbit`.
    period : int, optional
        Minimal period; by default that of the motion that the start leads to. It counts mesh periods, at most 1024.
    longest_step : float
        Longest step. A step has length 1 if a parameter changes by its whole range, or if the root mean square
        distance of all stroboscopic points is half a backlash.
    max_points : int
        Largest number of points in each direction.
    cascade : int
        Period doublings to follow from the first flip. It is the flip at which stability first changes on leaving
        the start; of two such flips, one in each direction, that with the nearer parameter. There are none if
        stability first changes at other events.
    pitchforks : bool
        Follow both branches at each pitchfork. They are branches of asymmetric orbits.
    events : mapping of str to callable, optional
        Further kinds of events: each root, along the branch, of a function of the `Orbit` is an event of that name.

    Raises
    ------
    InputError
        If a field breaks a rule; before any work.

    Examples
    --------
    >>> import gearchaos as gc
    >>> study = gc.Branch(gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.206), "eps1=0:0.3")
    >>> study.kind, study.period
    ('branch', None)
    """

    def __init__(
        self, model: AnyModel, axis: Axis | str, *, start: Mapping[str, float] | None = None, period: int | None = None,
        longest_step: float = 0.03, max_points: int = 10000, cascade: int = 0, pitchforks: bool = False, events:
        Mapping[str, Callable[[Orbit], float]] | None = None,
    ) -> None: ...

def curve(
    model: AnyModel, event: Literal["fold", "flip", "neimark-sacker", "graze"], x: Axis | str, y: Axis | str, *, start:
    Mapping[str, float] | None = None, period: int | None = None, longest_step: float = 0.02, max_points: int = 10000,
) -> xr.Dataset:
    """Follow the curve of an event of periodic orbits over two parameters.

    It is followed in both directions, with its points of codimension 2.

    Parameters
    ----------
    model : MeshModel, GearPair, GearDesign or Train
        The curve begins at the event nearest to the model's own value of ``x``, on the branch of an orbit along
        ``x``. If the orbit at the model's own values is at such an event already, the curve begins there.
    event : {"fold", "flip", "neimark-sacker", "graze"}
        The event whose curve is followed. A graze may be at either boundary of contact, whichever is nearer.
    x : Axis or str
        A parameter and its range, "omega=0.2:2.5"; a number of values is accepted and has no effect.
    y : Axis or str
        Another one.
    start : mapping of str to float, optional
        Initial values near the first orbit; by default those of the model. If its own lead to a motion of another
        period, the orbit is found as by `orbit`.
    period : int, optional
        Minimal period; by default that of the motion that the start leads to. It counts mesh periods, at most 1024.
    longest_step : float
        Longest step. A step has length 1 if a parameter changes by its whole range, or if the root mean square
        distance of all stroboscopic points is half a backlash.
    max_points : int
        Largest number of points in each direction.

    Returns
    -------
    xarray.Dataset
        Over ``point``, in order along the curve: both parameters as coordinates, ``section_<coordinate>`` (point,
        cycle), ``multipliers_real`` and ``multipliers_imag`` (point, exponent), ``residual``, and for Neimark-Sacker
        ``angle``, the argument of the critical multiplier in radians. Over ``special``, the points of codimension 2:
        ``special_kind`` and both parameters, ``special_<parameter>``. Attributes: ``event``, ``period``, ``boundary``
        (1 or −1 for a graze, otherwise 0); ``ends`` and ``closed`` are JSON.

    Raises
    ------
    InputError
        If an argument is out of range, the model's own values lie outside the axes, there is no orbit of this period
        near the start, or its branch has no such event; the message then has those that it has.

    Notes
    -----
    Pseudo-arclength continuation of the orbit together with the condition of the event: a singular matrix of the linear
    equations with the critical multiplier (W. Govaerts, Numerical Methods for Bifurcations of Dynamical Equilibria,
    2000), or an extremum of z on a boundary. Every point of a result can be the start of the same curve: set both
    parameters in the model, and give ``section_<coordinate>`` as ``start``.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(omega=1.9, zeta=0.05, eps1=0.02, kind="single")
    >>> found = gc.curve(model, "flip", "omega=1.7:2.1", "eps1=0:0.06", period=1)
    >>> found.attrs["period"]
    1
    """

class Curve(_Curve):
    """The study that `curve` runs.

    As a value it can be kept, and given to `gearchaos.run`: this computes it in memory or into a store.
    `curve` says what it finds.

    Parameters
    ----------
    model : MeshModel, GearPair, GearDesign or Train
        The curve begins at the event nearest to the model's own value of ``x``, on the branch of an orbit along
        ``x``. If the orbit at the model's own values is at such an event already, the curve begins there.
    event : {"fold", "flip", "neimark-sacker", "graze"}
        The event whose curve is followed. A graze may be at either boundary of contact, whichever is nearer.
    x : Axis or str
        A parameter and its range, "omega=0.2:2.5"; a number of values is accepted and has no effect.
    y : Axis or str
        Another one.
    start : mapping of str to float, optional
        Initial values near the first orbit; by default those of the model. If its own lead to a motion of another
        period, the orbit is found as by `orbit`.
    period : int, optional
        Minimal period; by default that of the motion that the start leads to. It counts mesh periods, at most 1024.
    longest_step : float
        Longest step. A step has length 1 if a parameter changes by its whole range, or if the root mean square
        distance of all stroboscopic points is half a backlash.
    max_points : int
        Largest number of points in each direction.

    Raises
    ------
    InputError
        If a field breaks a rule; before any work.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(omega=1.9, zeta=0.05, eps1=0.02, kind="single")
    >>> gc.Curve(model, "flip", "omega=1.7:2.1", "eps1=0:0.06", period=1).event
    'flip'
    """

    def __init__(
        self, model: AnyModel, event: Literal["fold", "flip", "neimark-sacker", "graze"], x: Axis | str, y: Axis | str,
        *, start: Mapping[str, float] | None = None, period: int | None = None, longest_step: float = 0.02, max_points:
        int = 10000,
    ) -> None: ...

def skeleton(
    model: AnyModel, x: Axis | str, y: Axis | str, *, period: int = 4, lines: tuple[int, int] = (8, 5), starts: int = 3,
    journal: str | PathLike[str] | None = None, progress: bool = False, workers: int | None = None,
) -> xr.Dataset:
    """Find all curves of events in a window of two parameters.

    The events are folds, flips, Neimark-Sacker bifurcations and grazes. Stable motions are searched on lines parallel
    to both axes, and the branches of their orbits are followed along the lines, with the branches of doubled periods.
    Every event on them that lies on no known curve gives another curve.

    Parameters
    ----------
    model : MeshModel, GearPair, GearDesign or Train
        All parameters but those of the axes, and the initial values.
    x : Axis or str
        A parameter and its range, "omega=0.2:2.5:48". The number of values is that of the places at which motions
        are searched on a line; 48 if left out.
    y : Axis or str
        Another one; its number of values is 24 if left out.
    period : int
        Largest period of the orbits. It counts mesh periods.
    lines : (int, int)
        Numbers of lines along x and along y on which events are searched.
    starts : int
        Initial states at each place, besides the model's own.
    journal : str | PathLike[str], optional
        A file that keeps finished work. If it exists, the same call goes on from there.
    progress : bool
        Show progress on stderr, and tell a long computing time before the work.
    workers : int, optional
        Processes, by default one per core. With 1 all is computed in this process.

    Returns
    -------
    xarray.Dataset
        Over ``point``, the points of all curves one after another: both parameters as coordinates, ``curve``, the
        number of the curve, and variables as those of `curve`; ``section_<coordinate>`` is NaN after the last point of
        an orbit. Over ``curve``: ``curve_kind``, ``curve_period``, ``curve_boundary`` (1 or −1 for a graze, otherwise
        0) and ``curve_closed``. Over ``special``, the points of codimension 2: ``special_kind``, both parameters and
        ``special_curve``. The attributes ``ends`` (of each curve) and ``failed`` (numbers of events whose curve could
        not be followed, by reason) are JSON.

    Raises
    ------
    InputError
        If an argument is out of range, or the journal is one of another skeleton.
    OSError
        If a worker process dies, or the journal cannot be written.

    Notes
    -----
    A curve is found if a branch through a stable motion on one of the lines meets it, or if another of its events does;
    more lines, places and starts find more. The result does not depend on the number of workers. Processes are started
    by importing the main module anew, so that a script must call this under ``if __name__ == "__main__":``.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(q0=0.1)
    >>> curves = gc.skeleton(
    ...     model, "omega=1.7:2.3:8", "eps1=0.03:0.09:4", period=1, lines=(1, 1), starts=0, workers=1)
    >>> curves.curve_kind.values.tolist()
    ['flip', 'flip']
    """

class Skeleton(_Skeleton):
    """The study that `skeleton` runs.

    As a value it can be kept, and given to `gearchaos.run`: this computes it in memory or into a store.
    `skeleton` says what it finds.

    Parameters
    ----------
    model : MeshModel, GearPair, GearDesign or Train
        All parameters but those of the axes, and the initial values.
    x : Axis or str
        A parameter and its range, "omega=0.2:2.5:48". The number of values is that of the places at which motions
        are searched on a line; 48 if left out.
    y : Axis or str
        Another one; its number of values is 24 if left out.
    period : int
        Largest period of the orbits. It counts mesh periods.
    lines : (int, int)
        Numbers of lines along x and along y on which events are searched.
    starts : int
        Initial states at each place, besides the model's own.

    Raises
    ------
    InputError
        If a field breaks a rule; before any work.

    Examples
    --------
    >>> import gearchaos as gc
    >>> gc.Skeleton(gc.MeshModel.of(q0=0.1), "omega=1.7:2.3", "eps1=0.03:0.09:4").x.count
    48
    """

    def __init__(
        self, model: AnyModel, x: Axis | str, y: Axis | str, *, period: int = 4, lines: tuple[int, int] = (8, 5),
        starts: int = 3,
    ) -> None: ...

def manifolds(
    model: AnyModel, *, period: int = 4, length: float = 30.0, spacing: float = 0.03, region: Mapping[str, tuple[float,
    float]] | None = None,
) -> xr.Dataset:
    """Find the saddles of a model with two coordinates, and their stable and unstable manifolds.

    The stable manifolds of saddles are the boundaries between basins of attraction; the unstable ones lead to the
    attractors.

    Parameters
    ----------
    model : MeshModel, GearPair, GearDesign or Train
        The operating point; its relative motion must have two coordinates, z and z_dot.
    period : int
        Largest period of the saddles, in mesh periods.
    length : float
        Arclength inside the region of each branch, in half backlashes.
    spacing : float
        Largest distance of neighbouring points inside the region.
    region : mapping of str to (float, float), optional
        Ranges of ``z`` and ``z_dot``; by default ±4 and ±3.

    Returns
    -------
    xarray.Dataset
        Over ``point``, the points of all branches one after another, each in order from its saddle: ``z`` and ``z_dot``
        at phase 0, and ``manifold``, the number of the branch. Over ``number``, the branches: ``manifold_saddle``, the
        number of the saddle, ``manifold_stable``, and ``manifold_complete``: whether the branch was followed to this
        length, or ended before outside the region or on an attractor. Over ``saddle_number``, the saddles:
        ``saddle_period``, ``saddle_multipliers_real`` and ``saddle_multipliers_imag`` (saddle_number, exponent),
        ``saddle_residual``, and their points ``saddle_section_z`` and ``saddle_section_z_dot`` (saddle_number, cycle).

    Raises
    ------
    InputError
        If the relative motion has more than two coordinates, or an argument is out of range.

    Notes
    -----
    D. Hobson, An efficient method for computing invariant manifolds of planar maps, J. Comput. Phys. 104, 1993. Saddles
    are found by Newton's method from many initial states: one that no start leads to is missing. A stable manifold is
    the unstable one in reversed time.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(kind="single", omega=0.7, q0=0.1, eps1=0.05)
    >>> found = gc.manifolds(model, period=1, length=5.0)
    >>> found.sizes["number"], found.saddle_period.values.tolist()
    (4, [1])
    """

class Manifolds(_Manifolds):
    """The study that `manifolds` runs.

    As a value it can be kept, and given to `gearchaos.run`: this computes it in memory or into a store.
    `manifolds` says what it finds.

    Parameters
    ----------
    model : MeshModel, GearPair, GearDesign or Train
        The operating point; its relative motion must have two coordinates, z and z_dot.
    period : int
        Largest period of the saddles, in mesh periods.
    length : float
        Arclength inside the region of each branch, in half backlashes.
    spacing : float
        Largest distance of neighbouring points inside the region.
    region : mapping of str to (float, float), optional
        Ranges of ``z`` and ``z_dot``; by default ±4 and ±3.

    Raises
    ------
    InputError
        If a field breaks a rule; before any work.

    Examples
    --------
    >>> import gearchaos as gc
    >>> gc.Manifolds(gc.MeshModel.of(kind="single", omega=0.7, q0=0.1, eps1=0.05), period=1).spacing
    0.03
    """

    def __init__(
        self, model: AnyModel, *, period: int = 4, length: float = 30.0, spacing: float = 0.03, region: Mapping[str,
        tuple[float, float]] | None = None,
    ) -> None: ...

def edge_state(
    model: AnyModel, first: Mapping[str, float], second: Mapping[str, float], *, period: int = 4, rounds: int = 60,
    settings: Classification | None = None,
) -> EdgeState:
    """Find the saddle that divides the basins of two attractors, for any number of coordinates.

    Its stable manifold is the boundary between them.

    Parameters
    ----------
    model : MeshModel, GearPair, GearDesign or Train
        The operating point.
    first : mapping of str to float
        Initial values that lead to one attractor.
    second : mapping of str to float
        Initial values that lead to another one.
    period : int
        Largest period of the saddle, in mesh periods.
    rounds : int
        Most times two neighbouring states are brought together again. They are on both sides of the boundary.
    settings : Classification, optional
        Lengths of the runs by which motions are classified.

    Returns
    -------
    EdgeState

    Raises
    ------
    InputError
        If both lead to the same attractor, or an argument is out of range.

    Notes
    -----
    Edge tracking: J. D. Skufca, J. A. Yorke, B. Eckhardt, Phys. Rev. Lett. 96, 174101, 2006. Attractors without a
    period are told apart by their kind of motion alone. A fractal boundary may contain several saddles: one of them is
    found, which depends on ``first`` and ``second``, and on their order.

    `gearchaos.run` of the study gives a Dataset: ``section_<coordinate>`` over "round", the states on the boundary in
    order of time, and the attribute ``orbit``, the saddle as JSON, null for none.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(kind="single", omega=0.7, q0=0.1, eps1=0.05)
    >>> found = gc.edge_state(model, {"z": 0.0, "z_dot": 0.0}, {"z": 1.5, "z_dot": 0.0})
    >>> found.orbit.period, found.orbit.unstable
    (1, 1)
    """

class EdgeTracking(_EdgeTracking):
    """The study that `edge_state` runs.

    As a value it can be kept, and given to `gearchaos.run`: this computes it in memory or into a store.
    `edge_state` says what it finds.

    Parameters
    ----------
    model : MeshModel, GearPair, GearDesign or Train
        The operating point.
    first : mapping of str to float
        Initial values that lead to one attractor.
    second : mapping of str to float
        Initial values that lead to another one.
    period : int
        Largest period of the saddle, in mesh periods.
    rounds : int
        Most times two neighbouring states are brought together again. They are on both sides of the boundary.
    settings : Classification, optional
        Lengths of the runs by which motions are classified.

    Raises
    ------
    InputError
        If a field breaks a rule; before any work.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(kind="single", omega=0.7, q0=0.1, eps1=0.05)
    >>> gc.EdgeTracking(model, {"z": 0.0, "z_dot": 0.0}, {"z": 1.5, "z_dot": 0.0}).rounds
    60
    """

    def __init__(
        self, model: AnyModel, first: Mapping[str, float], second: Mapping[str, float], *, period: int = 4, rounds: int
        = 60, settings: Classification | None = None,
    ) -> None: ...
