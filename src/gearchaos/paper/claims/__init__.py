"""The statements of the paper, judged: `judge_all` computes, compares and returns one record per statement."""

from gearchaos.paper.claims._judge import Claim, claims_of, failed, judge_all
from gearchaos.paper.claims._outcome import VERDICTS

__all__ = ["VERDICTS", "Claim", "claims_of", "failed", "judge_all"]
