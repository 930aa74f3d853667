"""Journals of the writers of a store, and what all of them together say: which tiles are done."""
