"""The explorer: a map of motions in the browser, and wherever one points, the motion behind it."""
