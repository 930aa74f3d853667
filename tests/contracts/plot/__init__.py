"""Pictures and cards, by the data of their artists."""
