"""A gear pair as its drawing describes it: its inputs and their checks, and the gear pair that follows from it."""
