"""Codes by which maps record what is proved of the motion in each cell."""

from __future__ import annotations

from enum import IntEnum

from gearchaos.proof.certificate import Certificate, Unproved


class Proved(IntEnum):
    """Whether the motion of a cell is proved to be periodic."""

    NOT_PERIODIC = -1
    NOT_PROVED = 0
    PROVED = 1


NO_REASON = 0
"""Code of the reason where there is none: the motion is proved, or its verdict is not periodic."""

INFERRED = 1
"""Code of the reason of a periodic motion that was inferred from neighbouring cells, not computed."""

REASON_CODES = {
    NO_REASON: "none", INFERRED: "inferred", 2: "Newton diverged", 3: "section on the contact boundary",
    4: "tangency undecided", 5: "windows overlap", 6: "too many switches", 7: "Krawczyk not contracting",
    8: "period not minimal", 9: "neutral", 10: "bits exhausted", 11: "too many steps",
}
"""The reasons for which a periodic motion is not proved, by their codes in files of results. New ones are appended."""


def proof_codes(result: Certificate | Unproved) -> tuple[int, int]:
    """The codes (`Proved`, reason) of the result of a proof."""
    if isinstance(result, Unproved):
        codes = {reason: code for code, reason in REASON_CODES.items()}
        return int(Proved.NOT_PROVED), codes[result.reason]
    return int(Proved.PROVED), NO_REASON
