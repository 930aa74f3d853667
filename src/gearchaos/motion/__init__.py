"""What motion is it: recurrence, orbit polishing, Floquet multipliers, Lyapunov exponents, spectrum, verdict."""

from gearchaos.motion.budget import Budget
from gearchaos.motion.label import REASONS, Label, Reason, motion_name
from gearchaos.motion.verdict import Verdicts, classify

__all__ = ["REASONS", "Budget", "Label", "Reason", "Verdicts", "classify", "motion_name"]
