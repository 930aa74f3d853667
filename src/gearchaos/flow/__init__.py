"""The exact flow of switched affine systems: affine steps between contact switches, located switches, tangent vectors
and measures. It knows nothing of gears, units or files; everything above it imports this package alone."""

from gearchaos.flow.exact import ExactFlow, Flowed, empty_measures
from gearchaos.flow.kernels.cancellation import StoppedError, cancel_event
from gearchaos.flow.kernels.compilation import cache_is_empty, on_compile
from gearchaos.flow.kernels.constants import CHATTER, DIVERGED, DIVERGED_AT, OK, WIDTH, Measure
from gearchaos.flow.newton import RESIDUAL, NewtonSearch, newton_search, next_round
from gearchaos.flow.rates import least_steps, rate
from gearchaos.flow.returns import near_returns
from gearchaos.flow.system import SwitchedSystem
from gearchaos.flow.tables import shared

__all__ = [
    "CHATTER", "DIVERGED", "DIVERGED_AT", "OK", "RESIDUAL", "WIDTH", "ExactFlow", "Flowed", "Measure", "NewtonSearch",
    "StoppedError", "SwitchedSystem", "cache_is_empty", "cancel_event", "empty_measures", "least_steps", "near_returns",
    "newton_search", "next_round", "on_compile", "rate", "shared",
]
