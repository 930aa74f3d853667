"""From a gear pair in SI to its dimensionless model, and results back in physical units."""
