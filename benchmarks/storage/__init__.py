"""Measurements of stores: what `benchmarks/stores.py` prints."""
