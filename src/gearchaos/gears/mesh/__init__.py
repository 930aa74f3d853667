"""One mesh of two wheels: the gear pair in SI, the tooth pairs that share its load, strips of helical teeth."""
