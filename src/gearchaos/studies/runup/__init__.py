"""Runs in which speed and torque change: computed ones, their jumps, measured ones beside them."""
