"""Periodic orbits of any stability, and how they change with parameters: branches, events, curves, manifolds."""
