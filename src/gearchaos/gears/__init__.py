"""From a gear pair in SI, or its drawing, to its dimensionless model, and results back in physical units."""
