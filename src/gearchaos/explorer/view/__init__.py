"""The state of a page: what is asked for, its address, the presets, and the bounds of every value."""
