"""Periodic orbits of any stability: their branches, curves of events, skeletons of maps, saddles."""
