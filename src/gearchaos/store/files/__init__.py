"""Files of a store in a folder on disk or in an object store: read, written durably, listed, locked, checked."""
