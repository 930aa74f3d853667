"""The answer of a standard where it gives no dynamic factor: outside its validity, or where an input is missing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar


@dataclass(frozen=True)
class Refused:
    """A dynamic factor that a standard does not give.

    Attributes
    ----------
    method : str
        The standard and its method.
    reason : str
        Why, in a sentence that ends with a full stop.
    """

    method: str
    reason: str
    value: ClassVar[None] = None
