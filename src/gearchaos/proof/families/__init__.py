"""Theorems about more than one orbit of one model: boxes of parameters, events between two values, chaotic sets."""
