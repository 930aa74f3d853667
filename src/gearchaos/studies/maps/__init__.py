"""Kinds of motion over one or two parameters: bifurcation diagrams, and maps with their refinement."""
