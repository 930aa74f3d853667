"""The speeds to avoid of the gears at the point, and the line of speeds on which they lie."""
