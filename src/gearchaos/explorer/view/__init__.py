"""The state of a page: the values that determine it, its address, the presets, and the bounds of every value."""
