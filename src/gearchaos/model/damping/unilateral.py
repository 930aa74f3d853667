"""Damping in a contact that never pulls, and ends where its force does."""

from gearchaos.model.damping.base import DampingLaw

LAW = DampingLaw(
    name="unilateral", words="in contact alone, never pulling", in_contact=True, releases=True,
    comment="2 zeta z' + chi f(z) in contact, which ends where this is 0.",
    script="side * max(0.0, side * (2 * zeta * z_dot + spring))")
