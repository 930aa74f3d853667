"""The explorer without a browser: state, computations, figures and what a visitor takes along."""
