"""Pictures: each function takes a Dataset or a model and ``ax=``, draws with plain matplotlib and returns the Axes.

`style` sets sizes and fonts for papers and slides, and `save_with_data` saves a picture with the data that it shows.
"""

from gearchaos.plot._agreement import agreement
from gearchaos.plot._attractors import attractors
from gearchaos.plot._backbone import backbone
from gearchaos.plot._basins import attractor_legend, attractor_names, basins
from gearchaos.plot._bifurcation import bifurcation
from gearchaos.plot._branch import branch
from gearchaos.plot._characteristics import backlash, stiffness
from gearchaos.plot._classes import CONTACT_CLASSES, MOTION_CLASSES, MotionClass, motion_class
from gearchaos.plot._data import save_with_data
from gearchaos.plot._dossier import dossier
from gearchaos.plot._dynamic_factor import dynamic_factor
from gearchaos.plot._gear_pair import gear_pair
from gearchaos.plot._history import history
from gearchaos.plot._level import level
from gearchaos.plot._lyapunov import lyapunov
from gearchaos.plot._manifolds import manifolds
from gearchaos.plot._mesh_stiffness import mesh_stiffness
from gearchaos.plot._phase import phase
from gearchaos.plot._portrait import portrait
from gearchaos.plot._response import response
from gearchaos.plot._result import result
from gearchaos.plot._ribbon import ribbon
from gearchaos.plot._schematic import schematic
from gearchaos.plot._separation_line import separation_line
from gearchaos.plot._skeleton import skeleton
from gearchaos.plot._spectrum import spectrum
from gearchaos.plot._style import style
from gearchaos.plot._transmission_error import transmission_error
from gearchaos.plot._zones import class_legend, zones

__all__ = [
    "CONTACT_CLASSES",
    "MOTION_CLASSES",
    "MotionClass",
    "agreement",
    "attractor_legend",
    "attractor_names",
    "attractors",
    "backbone",
    "backlash",
    "basins",
    "bifurcation",
    "branch",
    "class_legend",
    "dossier",
    "dynamic_factor",
    "gear_pair",
    "history",
    "level",
    "lyapunov",
    "manifolds",
    "mesh_stiffness",
    "motion_class",
    "phase",
    "portrait",
    "response",
    "result",
    "ribbon",
    "save_with_data",
    "schematic",
    "separation_line",
    "skeleton",
    "spectrum",
    "stiffness",
    "style",
    "transmission_error",
    "zones",
]
