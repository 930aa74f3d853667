"""Other ways to integrate the same systems, each at its best."""
