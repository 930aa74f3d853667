"""Damping in contact, as in a Kelvin–Voigt element, which may pull before it opens."""

from gearchaos.model.damping.base import DampingLaw

LAW = CONTACT = DampingLaw(
    name="contact", words="in contact alone", in_contact=True, releases=False,
    comment="2 zeta z' + chi f(z) in contact, 0 while the teeth are apart; it may pull before contact ends.",
    script="2 * zeta * z_dot * abs(side) + spring")
