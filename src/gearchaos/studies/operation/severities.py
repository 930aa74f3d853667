"""How severe a motion to avoid is: whether the teeth separate, where they hit, and whether they can bear it."""

from __future__ import annotations

from typing import Any

from gearchaos.studies.operation.beyond_the_teeth import BEYOND

CRITERION = "the teeth separate"
"""What makes a speed one to avoid; a motion that diverges counts as separated."""

FORCE_CRITERION = "the dynamic factor is too high"
"""What makes a speed one to avoid where the teeth stay in contact, with a limit of the dynamic factor."""

CONTACT_WORDS = ("permanent contact", "loss of contact", "both flanks", "no contact", BEYOND)
"""The contact states of `CONTACTS`, as a reader wants them named, then that of a motion that teeth cannot bear."""

SEVERITIES = (FORCE_CRITERION, "contact lost, small", "contact lost, hits", "hits both flanks", BEYOND)
"""What happens in a range to avoid, in rising order: whether contact is lost, whether the force exceeds the limit, and
where the teeth hit."""

SUDDEN = 2.0
"""Peak of the force on an undamped spring over the load that is put on at once: above it teeth hit."""


def separated(both_flanks: Any, hits: Any) -> Any:
    """The index into `SEVERITIES` of motions that teeth bear and in which they separate, elementwise."""
    return 1 + hits * (1 + both_flanks)
