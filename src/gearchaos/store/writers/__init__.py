"""The writers of a store: shards of a run, their locks, and the tiles that one takes over from another."""
