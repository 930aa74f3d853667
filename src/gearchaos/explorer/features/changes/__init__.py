"""Which change of a design widens its usable speeds."""
