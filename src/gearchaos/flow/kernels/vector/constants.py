"""Constants used by the kernels and by the functions that call them."""

TWO_PI = 6.283185307179586

WIDTH = 8
"""Lanes in a pack, and floats in a vector: one register with 512 bits, two with 256."""

ORDER = 14  # degree of the Taylor polynomials on a step

SLOTS = 32
"""Most packs that one kernel call advances at the same time; for d = 2 their step matrices fit the first-level
cache."""

PACKS = 2
"""Most packs that are resolved side by side; four are no faster for d = 2, and slower for d = 4."""

MAX_SWITCHES = 64  # contact switches within one step after which a lane gets the status `CHATTER`

DIVERGED_AT = 1e8
"""A trajectory has diverged when |z| or |z'| reaches this value, in half backlashes (per unit of τ)."""

OK, DIVERGED, CHATTER = 0, 1, 2
"""Status of a trajectory."""
