"""The public names for type checkers and editors; at run time ``__init__.py`` imports them on first use."""

from gearchaos import dynamics as dynamics
from gearchaos import flow as flow
from gearchaos import plot as plot
from gearchaos import studies as studies
from gearchaos.continuation.orbit import orbit as orbit
from gearchaos.continuation.orbit import orbits as orbits
from gearchaos.datasets import load as load
from gearchaos.datasets import save as save
from gearchaos.dynamics.settings import Classification as Classification
from gearchaos.errors import InputError as InputError
from gearchaos.explorer.web.notebook import explore as explore
from gearchaos.gears.design.gear_design import GearDesign as GearDesign
from gearchaos.gears.pair import GearPair as GearPair
from gearchaos.gears.results import physical as physical
from gearchaos.model import HarmonicStiffness as HarmonicStiffness
from gearchaos.model import MeshModel as MeshModel
from gearchaos.model import SteppedStiffness as SteppedStiffness
from gearchaos.model import TransmissionError as TransmissionError
from gearchaos.model import TwoLevelStiffness as TwoLevelStiffness
from gearchaos.store.run import Outcome as Outcome
from gearchaos.store.run import run as run
from gearchaos.studies.agreement import agreement as agreement
from gearchaos.studies.attractors import Attractors as Attractors
from gearchaos.studies.attractors import attractors as attractors
from gearchaos.studies.axis import Axis as Axis
from gearchaos.studies.basins import Basins as Basins
from gearchaos.studies.basins import basins as basins
from gearchaos.studies.bifurcation import Bifurcation as Bifurcation
from gearchaos.studies.bifurcation import bifurcation as bifurcation
from gearchaos.studies.branch import branch as branch
from gearchaos.studies.curve import curve as curve
from gearchaos.studies.dynamic_factor import dynamic_factor as dynamic_factor
from gearchaos.studies.manifolds import manifolds as manifolds
from gearchaos.studies.operating_map import operating_map as operating_map
from gearchaos.studies.regime import Regime as Regime
from gearchaos.studies.regime import regime as regime
from gearchaos.studies.simulate import Simulate as Simulate
from gearchaos.studies.simulate import simulate as simulate
from gearchaos.studies.skeleton import skeleton as skeleton
from gearchaos.studies.speeds_to_avoid import speeds_to_avoid as speeds_to_avoid
from gearchaos.studies.steady import steady as steady
from gearchaos.studies.verdict import Verdict as Verdict
from gearchaos.studies.zones import Zones as Zones
from gearchaos.studies.zones import zones as zones

__version__: str
