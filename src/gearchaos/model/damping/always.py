"""Damping across the open gap, too, as in (2.5)."""

from gearchaos.model.damping.base import DampingLaw

LAW = ALWAYS = DampingLaw(
    name="always", words="also across the gap", in_contact=False, releases=False,
    comment="2 zeta z' + chi f(z): the damping part acts in every contact state, so the force is not 0 while the teeth "
            "are apart. Contact is the variable contact.",
    script="2 * zeta * z_dot + spring")
