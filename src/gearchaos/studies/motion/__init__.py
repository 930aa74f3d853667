"""The motion at one operating point: its samples, its kind, all attractors and their basins."""
