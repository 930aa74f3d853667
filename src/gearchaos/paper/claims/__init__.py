"""The statements of the paper, checked: `check_all` computes, compares and returns one `Claim` for each statement."""

from gearchaos.paper.claims._check import Claim, check_all, claims_of, failed
from gearchaos.paper.claims._outcome import VERDICTS

__all__ = ["VERDICTS", "Claim", "check_all", "claims_of", "failed"]
