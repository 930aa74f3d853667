"""The exact flow of switched affine systems: affine steps between contact switches, located switches, tangent vectors
and measures.

The package depends on no other part of gearchaos, and deals with no gears, units or files. Other packages use only the
names exported here.
"""

from gearchaos.flow.exact import ExactFlow, FlowResult, StoppedError, cancel_event, combine_measures, of_meshes
from gearchaos.flow.kernels.compilation import cache_directory, cache_is_empty, on_compile
from gearchaos.flow.kernels.orbits.correction import Limits, Polynomials
from gearchaos.flow.kernels.orbits.orbits import (
    RESIDUAL,
    NewtonSearch,
    near_returns,
    newton_iteration,
    start_newton_search,
)
from gearchaos.flow.kernels.vector.constants import CHATTER, DIVERGED, DIVERGED_AT, OK, WIDTH
from gearchaos.flow.kernels.vector.measure import Measure
from gearchaos.flow.parallel_compilation import compile_beside, compile_corrections
from gearchaos.flow.polynomials import (
    CorrectedOrbit,
    CriticalMultiplier,
    NotConvergedError,
    PolynomialEquations,
    TouchingExtremum,
    correct_any,
)
from gearchaos.flow.schedule import Followed, follow_schedule
from gearchaos.flow.sensitivity import (
    Derivatives,
    DifferencedFlow,
    PeriodEquations,
    PeriodResult,
    SensitivityFlow,
    differentiate,
)
from gearchaos.flow.step_tables import steps_share_matrices
from gearchaos.flow.system import SwitchedSystem, fastest_rate, min_steps_per_period
from gearchaos.flow.target import Processor, processor

__all__ = [
    "CHATTER", "DIVERGED", "DIVERGED_AT", "OK", "RESIDUAL", "WIDTH", "CorrectedOrbit", "CriticalMultiplier",
    "Derivatives", "DifferencedFlow", "ExactFlow", "FlowResult", "Followed", "Limits", "Measure", "NewtonSearch",
    "NotConvergedError", "PeriodEquations", "PeriodResult", "PolynomialEquations", "Polynomials", "Processor",
    "SensitivityFlow", "StoppedError", "SwitchedSystem", "TouchingExtremum", "cache_directory", "cache_is_empty",
    "cancel_event", "combine_measures", "compile_beside", "compile_corrections", "correct_any", "differentiate",
    "fastest_rate", "follow_schedule", "min_steps_per_period", "near_returns", "newton_iteration", "of_meshes",
    "on_compile", "processor", "start_newton_search", "steps_share_matrices",
]
