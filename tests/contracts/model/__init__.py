"""The dimensionless model: names, rules, kinds of stiffness, damping laws."""
