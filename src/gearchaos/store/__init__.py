"""Studies that survive: computed tile by tile into a store on disk, resumed after any death, spread over machines."""
