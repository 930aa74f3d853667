"""Results compared with exact solutions, with invariants and with the definitions of the quantities."""
