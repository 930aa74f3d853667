"""The package itself: exported names, documentation, installation, dependencies, cached kernels."""
