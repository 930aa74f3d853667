"""Mutation tests: small faults are put into the sources one at a time, and some test must fail for each.

``make mutation`` runs a random sample of them. Nothing in the checkout changes: a process that tries a mutant loads
the one changed module from memory. The kernels of ``flow/`` are no part of this.
"""
