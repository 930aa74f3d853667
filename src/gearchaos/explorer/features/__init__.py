"""One room for each thing that a page shows: what is computed for it, its figures, its text."""
