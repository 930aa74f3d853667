"""Results as tables of text on stdout."""
