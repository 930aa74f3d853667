"""Gear trains: bodies, shafts and meshes in SI, the steady rotation, and the switched affine system of their motion."""
