"""What all features of the explorer share: the state of a page and its address, the style of figures, workers."""
