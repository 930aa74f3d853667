"""Damping laws of the mesh, one file each.

**To add a law,** write a `DampingLaw`, the ``LAW`` of a file of its own. One with the force of a law that the kernels
know ``acts_as`` that. Another force has its number in ``flow/kernels/vector/arrays.py`` and its formula in
``taylor.py`` there; where contact begins and ends is in ``flow/kernels/one_spring/contact.py``. Another package offers
one that acts as one of these, in ``gearchaos.damping``.
"""

from __future__ import annotations

from typing import Any

from gearchaos.model.damping.always import ALWAYS
from gearchaos.model.damping.base import DampingLaw
from gearchaos.model.damping.contact import CONTACT
from gearchaos.plugins import Register, declared, value_of

__all__ = [
    "ALWAYS", "CONTACT", "DAMPING_LAWS", "DEFAULT_LAW", "DEFAULT_LAW_OF_GEARS", "SHARED_LAWS", "Damped", "DampingLaw"]


def _fault(name: str, law: Any) -> str:
    """What is wrong with a law of another package; empty if nothing is."""
    if wrong := value_of(DampingLaw, "name")(name, law):
        return wrong
    known = DAMPING_LAWS.own.get(law.acts_as)
    if known is None or known.acts_as:
        kernel = [each.name for each in DAMPING_LAWS.own.values() if not each.acts_as]
        return f"it must act as one of {', '.join(kernel)}, not {law.acts_as!r}"
    alike = (known.in_contact, known.releases) == (law.in_contact, law.releases)
    return "" if alike else f"its in_contact and releases must be those of {known.name}, {known.in_contact} and " \
                            f"{known.releases}"


DAMPING_LAWS: Register[DampingLaw] = Register("gearchaos.damping", declared(__name__, "LAW"), _fault)
"""The damping laws by their names."""

SHARED_LAWS = tuple(law.name for law in DAMPING_LAWS.own.values() if not law.releases)
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

    @property
    def damping_in_words(self) -> str:
        """Where it acts, after "damping"."""
        return self.law.words

    @property
    def kernel_law(self) -> DampingLaw:
        """The law by which the kernels know it, for one of another package that which it acts as."""
        return DAMPING_LAWS.own[self.law.acts_as or self.law.name]
