"""Runs of studies: a study is computed tile by tile into a store on disk, resumed if it stops, shared by machines."""
