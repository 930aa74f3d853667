"""Proofs: what they return, write and refuse."""
