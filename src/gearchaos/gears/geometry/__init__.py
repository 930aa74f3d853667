"""The geometry of a gear pair: dimensions and their formulae, tooth profiles, backlash, masses of the wheels."""
