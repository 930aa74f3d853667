"""The dynamic factor K_v of a gear pair by several standards, one per file, and its main resonance."""
