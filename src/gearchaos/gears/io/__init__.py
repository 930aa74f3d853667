"""Values with units, and tables from files, as users and other programs write them."""
