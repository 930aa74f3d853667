"""Results compared with reference data: a stored table, the figures of the 2008 paper, and the documents."""
