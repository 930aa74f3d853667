"""The motion at the point: verdict, portraits, diagram, orbits and branches through it."""
