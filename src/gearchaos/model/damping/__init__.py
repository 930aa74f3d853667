"""Damping laws of the mesh, one file each.

**To add a law,** write a `DampingLaw` in a file of its own and enter it in `DAMPING_LAWS`. Its number for the kernels
is in ``flow/kernels/vector/arrays.py``, its force in ``taylor.py`` there, where contact begins and ends in
``flow/kernels/one_mesh/contact.py``.
"""

from __future__ import annotations

from gearchaos.model.damping.always import ALWAYS
from gearchaos.model.damping.base import DampingLaw
from gearchaos.model.damping.contact import CONTACT
from gearchaos.model.damping.unilateral import UNILATERAL

__all__ = ["ALWAYS", "CONTACT", "DAMPING_LAWS", "DEFAULT_LAW", "DEFAULT_LAW_OF_GEARS", "SHARED_LAWS", "UNILATERAL",
           "Damped", "DampingLaw"]

DAMPING_LAWS: dict[str, DampingLaw] = {law.name: law for law in (ALWAYS, CONTACT, UNILATERAL)}
"""The damping laws by their names."""

SHARED_LAWS = tuple(law.name for law in DAMPING_LAWS.values() if not law.releases)
"""The laws that several contacts with one damper can have."""

DEFAULT_LAW = ALWAYS.name  # as in the paper
DEFAULT_LAW_OF_GEARS = CONTACT.name  # nothing brakes a wheel of steel across the open gap


class Damped:
    """What has the name of a damping law, ``damping_law``, and by it the law."""

    damping_law: str

    @property
    def law(self) -> DampingLaw:
        """Where the mesh damping acts."""
        return DAMPING_LAWS[self.damping_law]
