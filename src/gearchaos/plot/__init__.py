"""Pictures: each function takes a Dataset or a model and ``ax=``, draws with plain matplotlib and returns the Axes.

`style` sets sizes and fonts for papers and slides, and `save_with_data` saves a picture with the data that it shows.
"""

from gearchaos.plot._assessment import assessment
from gearchaos.plot._contact_pattern import contact_pattern
from gearchaos.plot._datasets import save_with_data
from gearchaos.plot._design import harris_map, mesh_stiffness, transmission_error
from gearchaos.plot._dynamic_factor import dynamic_factor
from gearchaos.plot._fit import fit
from gearchaos.plot._gear_pair import gear_pair
from gearchaos.plot._model import backlash, schematic, stiffness
from gearchaos.plot._modes import campbell, modes
from gearchaos.plot._orders import orders
from gearchaos.plot._overlays import agreement, separation_line, skeleton
from gearchaos.plot._runup import runup
from gearchaos.plot._scatter import scatter
from gearchaos.plot._train import flanks, train
from gearchaos.plot.classes import CONTACT_CLASSES, MOTION_CLASSES, MotionClass, motion_class
from gearchaos.plot.diagrams import bifurcation, branch, lyapunov, response, response_curve
from gearchaos.plot.maps import class_legend, level, motion_strip, zones
from gearchaos.plot.motions import history, motion, phase, portrait, spectrum
from gearchaos.plot.results import result
from gearchaos.plot.states import attractor_legend, attractor_names, attractors, basins, manifolds
from gearchaos.plot.theme import style

__all__ = [
    "CONTACT_CLASSES", "MOTION_CLASSES", "MotionClass", "agreement", "assessment", "attractor_legend",
    "attractor_names", "attractors", "backlash", "basins", "bifurcation", "branch", "campbell", "class_legend",
    "contact_pattern", "dynamic_factor", "fit", "flanks", "gear_pair", "harris_map", "history", "level", "lyapunov",
    "manifolds", "mesh_stiffness", "modes", "motion", "motion_class", "motion_strip", "orders", "phase", "portrait",
    "response", "response_curve", "result", "runup", "save_with_data", "scatter", "schematic", "separation_line",
    "skeleton", "spectrum", "stiffness", "style", "train", "transmission_error", "zones",
]
