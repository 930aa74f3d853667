"""The statements of the paper, checked: `check_all` computes, compares and returns one `Claim` for each statement."""

from gearchaos.paper.claims._check import Claim, check_all, claims_of, failed
from gearchaos.paper.claims._outcome import CONTRADICTED, MISPRINT, VERDICTS, PeriodicMotion

__all__ = ["CONTRADICTED", "MISPRINT", "VERDICTS", "Claim", "PeriodicMotion", "check_all", "claims_of", "failed"]
