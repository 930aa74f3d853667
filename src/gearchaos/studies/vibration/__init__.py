"""What a steady motion sounds like: orders and sidebands, natural frequencies, rattle."""
