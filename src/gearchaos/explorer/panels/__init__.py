"""What a page shows: one figure per file, and the texts beside the figures."""
