"""What motion is it: recurrence, orbit polishing, Floquet multipliers, Lyapunov exponents, spectrum, verdict."""

from gearchaos.dynamics.labels import REASONS, Label, Reason, motion_name
from gearchaos.dynamics.settings import Classification
from gearchaos.dynamics.state import ClassificationState
from gearchaos.dynamics.verdict import STAGES, Verdicts, classify, conclude

__all__ = [
           "REASONS",
           "STAGES",
           "Classification",
           "ClassificationState",
           "Label",
           "Reason",
           "Verdicts",
           "classify",
           "conclude",
           "motion_name",
]
