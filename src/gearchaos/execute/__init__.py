"""Computation of work items in threads, in processes and on clusters, for any kind of study."""
