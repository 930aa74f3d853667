"""What motion is it: recurrence, orbit polishing, Floquet multipliers, Lyapunov exponents, spectrum, verdict."""

from gearchaos.motion.budget import Budget
from gearchaos.motion.label import REASONS, Label, Reason, motion_name
from gearchaos.motion.sheet import Sheet
from gearchaos.motion.verdict import STAGES, Verdicts, classify, conclude

__all__ = ["REASONS", "STAGES", "Budget", "Label", "Reason", "Sheet", "Verdicts", "classify", "conclude", "motion_name"]
