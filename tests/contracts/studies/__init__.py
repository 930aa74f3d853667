"""Studies: arguments, results, records, bad input."""
