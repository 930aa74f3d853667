"""How results lie in the files of a store: records of tiles, chunks, and groups of them in Zarr's format."""
