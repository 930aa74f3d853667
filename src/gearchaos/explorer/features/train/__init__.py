"""A gear train as a scheme: its bodies, shafts and meshes."""
