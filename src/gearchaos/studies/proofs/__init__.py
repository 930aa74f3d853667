"""What is proved of motions: periodic orbits, events, boxes and chaotic sets, also in the cells of a map."""
