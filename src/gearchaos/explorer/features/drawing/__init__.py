"""The gears of a drawing: teeth in mesh, numbers and curves over the mesh cycle, beside those of another drawing."""
