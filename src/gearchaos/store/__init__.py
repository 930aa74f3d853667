"""Durable runs: a study is computed tile by tile into a store on disk, resumed if it stops, shared among machines."""
