"""Gears at a speed and a torque: their models, deflection and separation, results in their units."""
