"""Mutation testing: the sources are changed in one place at a time, and some test must then fail.

``make mutation`` runs a random sample of such mutants. No file of the checkout is changed: the process that tests a
mutant loads the one changed module from memory. The kernels of ``flow/`` are not mutated.
"""
