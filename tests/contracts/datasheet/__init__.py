"""Contracts of datasheets and of the standards that they show."""
