"""Classification of motions by recurrence, periodic orbits, Floquet multipliers, Lyapunov exponents and spectra."""

from gearchaos.dynamics.labelling import STAGES, classify, conclude
from gearchaos.dynamics.settings import Classification
from gearchaos.dynamics.transients import ClassificationState
from gearchaos.dynamics.verdicts import ON_ATTRACTOR, REASONS, Label, Reason, Verdicts, motion_name

__all__ = ["ON_ATTRACTOR", "REASONS", "STAGES", "Classification", "ClassificationState", "Label", "Reason", "Verdicts",
           "classify", "conclude", "motion_name"]
