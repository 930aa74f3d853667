"""The run-up: its computation, its figures and what is played of it."""
