"""Stores and the runs into them: layout, damage, resumption, engines."""
