"""The map: its cells from coarse to fine, the curves over it, its legend."""
