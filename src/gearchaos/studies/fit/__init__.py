"""Parameters of a gear pair from what is measured of it."""
