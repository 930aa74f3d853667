"""The statements of the paper, checked: `check_all` computes, compares and returns one `Claim` for each statement."""

from gearchaos.paper.claims import _attractors, _maps, _motions, _windows  # noqa: F401 - they register their checks
from gearchaos.paper.claims._claim import (
    CONTRADICTED,
    MISPRINT,
    VERDICTS,
    Claim,
    PeriodicMotion,
    check_all,
    claims_of,
    failed,
)

__all__ = ["CONTRADICTED", "MISPRINT", "VERDICTS", "Claim", "PeriodicMotion", "check_all", "claims_of", "failed"]
