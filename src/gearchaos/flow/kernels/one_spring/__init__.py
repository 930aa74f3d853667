"""The main loop for systems with one mesh: affine steps, contact switches, measures on the way."""
