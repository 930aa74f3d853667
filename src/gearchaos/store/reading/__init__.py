"""What is read from a store: Datasets, exported files, reduced pictures, its state, what is missing or damaged."""
