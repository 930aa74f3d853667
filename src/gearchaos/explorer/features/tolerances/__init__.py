"""What tolerances do to the motion at the point: a cloud of gears."""
