"""What motion is it: recurrence, orbit polishing, Floquet multipliers, Lyapunov exponents, spectrum, verdict."""

from gearchaos.motion.verdict import REASONS, Budget, Label, Reason, Verdicts, classify

__all__ = ["REASONS", "Budget", "Label", "Reason", "Verdicts", "classify"]
