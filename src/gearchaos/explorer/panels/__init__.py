"""What a page shows: the figures, and the texts beside the figures."""
