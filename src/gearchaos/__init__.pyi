"""The public names for type checkers and editors; at run time ``__init__`` imports them on first use.

``python -m gearchaos.studies.core.generate`` writes this from the names there and from the classes of the studies.
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
from gearchaos.dynamics.settings import Classification as Classification
from gearchaos.errors import InputError as InputError
from gearchaos.explorer.web.server import explore as explore
from gearchaos.formats import save as save
from gearchaos.gears.design.gear_design import GearDesign as GearDesign
from gearchaos.gears.mesh.pair import GearPair as GearPair
from gearchaos.gears.operation.operating import AnyModel
from gearchaos.gears.operation.results import physical as physical
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
from gearchaos.studies.core.axis import Axis as Axis
from gearchaos.studies.fit.fit import Fit as _Fit
from gearchaos.studies.maps.bifurcation import Bifurcation as _Bifurcation
from gearchaos.studies.maps.zones import Zones as _Zones
from gearchaos.studies.motion.attractors import Attractors as _Attractors
from gearchaos.studies.motion.basins import Basins as _Basins
from gearchaos.studies.motion.regime import Regime as _Regime
from gearchaos.studies.motion.regime import Verdict as Verdict
from gearchaos.studies.motion.regime import steady as steady
from gearchaos.studies.motion.simulate import Simulate as _Simulate
from gearchaos.studies.orbits.agreement import agreement as agreement
from gearchaos.studies.orbits.branch import Branch as _Branch
from gearchaos.studies.orbits.curve import Curve as _Curve
from gearchaos.studies.orbits.saddles import EdgeTracking as _EdgeTracking
from gearchaos.studies.orbits.saddles import Manifolds as _Manifolds
from gearchaos.studies.orbits.skeleton import Skeleton as _Skeleton
from gearchaos.studies.proofs.chaos_proof import prove_chaos as prove_chaos
from gearchaos.studies.proofs.proofs import prove as prove
from gearchaos.studies.proofs.proofs import prove_box as prove_box
from gearchaos.studies.proofs.proofs import prove_event as prove_event
from gearchaos.studies.runup.runup import RunUp as _RunUp
from gearchaos.studies.speeds.assess import assess as assess
from gearchaos.studies.speeds.speed_and_torque import dynamic_factor as dynamic_factor
from gearchaos.studies.speeds.speed_and_torque import operating_map as operating_map
from gearchaos.studies.speeds.speeds_to_avoid import speeds_to_avoid as speeds_to_avoid
from gearchaos.studies.uncertainty.scatter import Scatter as _Scatter
from gearchaos.studies.vibration.natural_frequencies import natural_frequencies as natural_frequencies
from gearchaos.studies.vibration.orders import Orders as _Orders
from gearchaos.studies.vibration.rattle import Rattle as _Rattle
from gearchaos.studyfile.loading import open as open

__version__: str

def simulate(
    model: AnyModel, periods: int, transient: int = 0, samples: int | None = None, *, progress: bool = False,
) -> xr.Dataset:
    """Integrate one motion: its stroboscopic section, one state per mesh period, and samples in time."""

class Simulate(_Simulate):
    """Integrate one motion: its stroboscopic section, one state per mesh period, and samples in time."""

    def __init__(
        self, model: AnyModel, periods: int, transient: int = 0, samples: int | None = None,
    ) -> None: ...

def regime(
    model: AnyModel, *, settings: Classification | None = None, progress: bool = False,
) -> Verdict:
    """Classify the motion at one operating point, with its evidence."""

class Regime(_Regime):
    """Classify the motion at one operating point, with its evidence."""

    def __init__(
        self, model: AnyModel, *, settings: Classification | None = None,
    ) -> None: ...

def attractors(
    model: AnyModel, starts: int = 256, *, box: Mapping[str, tuple[float, float]] | None = None, seed: int = 0, sweep:
    Axis | str | None = None, kicks: int = 0, settings: Classification | None = None, progress: bool = False, threads:
    int | None = None,
) -> xr.Dataset:
    """Find all attractors of one operating point, with the share of the initial states that lead to each."""

class Attractors(_Attractors):
    """Find all attractors of one operating point, with the share of the initial states that lead to each."""

    def __init__(
        self, model: AnyModel, starts: int = 256, *, box: Mapping[str, tuple[float, float]] | None = None, seed: int =
        0, sweep: Axis | str | None = None, kicks: int = 0, settings: Classification | None = None,
    ) -> None: ...

def bifurcation(
    model: AnyModel, axis: Axis | str, *, points: int = 128, mode: Literal["fixed", "up", "down"] = 'fixed', settings:
    Classification | None = None, progress: bool = False, threads: int | None = None,
) -> xr.Dataset:
    """Scan one parameter: stroboscopic points, verdicts and exponents."""

class Bifurcation(_Bifurcation):
    """Scan one parameter: stroboscopic points, verdicts and exponents."""

    def __init__(
        self, model: AnyModel, axis: Axis | str, *, points: int = 128, mode: Literal["fixed", "up", "down"] = 'fixed',
        settings: Classification | None = None,
    ) -> None: ...

def rattle(
    model: AnyModel, axis: Axis | str, *, mesh: str | None = None, settings: Classification | None = None,
) -> xr.Dataset:
    """Scan a train for rattle: where its meshes lose contact, their impacts, and the drag that stops them."""

class Rattle(_Rattle):
    """Scan a train for rattle: where its meshes lose contact, their impacts, and the drag that stops them."""

    def __init__(
        self, model: AnyModel, axis: Axis | str, *, mesh: str | None = None, settings: Classification | None = None,
    ) -> None: ...

def fit(
    model: AnyModel, measured: str, vary: tuple[str, ...], *, quantity: Literal["mesh force", "deflection",
    "transmission error", "acceleration"] = 'mesh force', uncertainty: str | None = None, starts: int = 8, seed: int =
    0, columns: Mapping[str, str] | None = None,
) -> xr.Dataset:
    """Fit damping, backlash and transmission error of a gear pair to measured orders over the speed."""

class Fit(_Fit):
    """Fit damping, backlash and transmission error of a gear pair to measured orders over the speed."""

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
    """Compute the order spectrum of a steady motion, its lines named by mesh harmonics and sidebands."""

class Orders(_Orders):
    """Compute the order spectrum of a steady motion, its lines named by mesh harmonics and sidebands."""

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
    """Run gears up through a range of speeds, and down again: response, jumps, orders of the mesh force."""

class RunUp(_RunUp):
    """Run gears up through a range of speeds, and down again: response, jumps, orders of the mesh force."""

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
    """Say what the scatter of uncertain inputs does to contact loss and dynamic factor along the speed."""

class Scatter(_Scatter):
    """Say what the scatter of uncertain inputs does to contact loss and dynamic factor along the speed."""

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
    """Map the kinds of motion over two parameters."""

class Zones(_Zones):
    """Map the kinds of motion over two parameters."""

    def __init__(
        self, model: AnyModel, x: Axis | str, y: Axis | str, *, starts: int = 1, load_change: float = 1.0, wide: bool =
        False, refine: int = 1, prove: bool = False, certificates: str | None = None, settings: Classification | None =
        None,
    ) -> None: ...

def basins(
    model: AnyModel, x: Axis | str, y: Axis | str, *, settings: Classification | None = None, progress: bool = False,
    threads: int | None = None,
) -> xr.Dataset:
    """Map the basins of attraction over two initial values."""

class Basins(_Basins):
    """Map the basins of attraction over two initial values."""

    def __init__(
        self, model: AnyModel, x: Axis | str, y: Axis | str, *, settings: Classification | None = None,
    ) -> None: ...

def branch(
    model: AnyModel, axis: Axis | str, *, start: Mapping[str, float] | None = None, period: int | None = None,
    longest_step: float = 0.03, max_points: int = 10000, cascade: int = 0, pitchforks: bool = False, events:
    Mapping[str, Callable[[Orbit], float]] | None = None,
) -> xr.Dataset:
    """Follow a branch of periodic orbits along one parameter, stable or not, with all its events."""

class Branch(_Branch):
    """Follow a branch of periodic orbits along one parameter, stable or not, with all its events."""

    def __init__(
        self, model: AnyModel, axis: Axis | str, *, start: Mapping[str, float] | None = None, period: int | None = None,
        longest_step: float = 0.03, max_points: int = 10000, cascade: int = 0, pitchforks: bool = False, events:
        Mapping[str, Callable[[Orbit], float]] | None = None,
    ) -> None: ...

def curve(
    model: AnyModel, event: Literal["fold", "flip", "neimark-sacker", "graze"], x: Axis | str, y: Axis | str, *, start:
    Mapping[str, float] | None = None, period: int | None = None, longest_step: float = 0.02, max_points: int = 10000,
) -> xr.Dataset:
    """Follow the curve of an event of periodic orbits over two parameters."""

class Curve(_Curve):
    """Follow the curve of an event of periodic orbits over two parameters."""

    def __init__(
        self, model: AnyModel, event: Literal["fold", "flip", "neimark-sacker", "graze"], x: Axis | str, y: Axis | str,
        *, start: Mapping[str, float] | None = None, period: int | None = None, longest_step: float = 0.02, max_points:
        int = 10000,
    ) -> None: ...

def skeleton(
    model: AnyModel, x: Axis | str, y: Axis | str, *, period: int = 4, lines: tuple[int, int] = (8, 5), starts: int = 3,
    journal: str | PathLike[str] | None = None, progress: bool = False, workers: int | None = None,
) -> xr.Dataset:
    """Find all curves of events in a window of two parameters."""

class Skeleton(_Skeleton):
    """Find all curves of events in a window of two parameters."""

    def __init__(
        self, model: AnyModel, x: Axis | str, y: Axis | str, *, period: int = 4, lines: tuple[int, int] = (8, 5),
        starts: int = 3,
    ) -> None: ...

def manifolds(
    model: AnyModel, *, period: int = 4, length: float = 30.0, spacing: float = 0.03, region: Mapping[str, tuple[float,
    float]] | None = None,
) -> xr.Dataset:
    """Find the saddles of a model with two coordinates, and their stable and unstable manifolds."""

class Manifolds(_Manifolds):
    """Find the saddles of a model with two coordinates, and their stable and unstable manifolds."""

    def __init__(
        self, model: AnyModel, *, period: int = 4, length: float = 30.0, spacing: float = 0.03, region: Mapping[str,
        tuple[float, float]] | None = None,
    ) -> None: ...

def edge_state(
    model: AnyModel, first: Mapping[str, float], second: Mapping[str, float], *, period: int = 4, rounds: int = 60,
    settings: Classification | None = None,
) -> EdgeState:
    """Find the saddle that divides the basins of two attractors, for any number of coordinates."""

class EdgeTracking(_EdgeTracking):
    """Find the saddle that divides the basins of two attractors, for any number of coordinates."""

    def __init__(
        self, model: AnyModel, first: Mapping[str, float], second: Mapping[str, float], *, period: int = 4, rounds: int
        = 60, settings: Classification | None = None,
    ) -> None: ...
