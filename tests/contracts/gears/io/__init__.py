"""Contracts of values with units and of tables from files."""
