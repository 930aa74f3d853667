"""The least knock that leads from the motion at the point to one to avoid."""
