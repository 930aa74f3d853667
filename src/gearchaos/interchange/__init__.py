"""The equations of a model for other tools: SymPy, and stand-alone scripts for SciPy and DynamicalSystems.jl."""
