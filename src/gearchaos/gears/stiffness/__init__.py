"""The mesh stiffness of a gear pair: by ISO 6336-1, by the potential-energy method, or from a table."""
