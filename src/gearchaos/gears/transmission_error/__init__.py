"""The static transmission error of unloaded gears: from accuracy grade, tip relief, or measured values."""
