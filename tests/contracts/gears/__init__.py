"""Gear designs, pairs and trains as inputs: units, tables, refusals, warnings, datasheets."""
