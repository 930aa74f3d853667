"""Independent integrations of the paper's equations, to hold the exact flow against.

Each oracle is written from (2.12)-(2.18) with the corrections of ``docs/model.md`` and reads the parameters of a
`MeshModel`, nothing else of the package: no common formula can be wrong in both. They work in the paper's own
coordinates (x1, x1', x2, ...), not in the reduced ones of the package.
"""
