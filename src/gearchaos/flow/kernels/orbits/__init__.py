"""Periodic orbits: near returns, Newton's method, sensitivities by parameters, corrections along a branch."""
