"""The compiled part of the flow, with its compilation, vector types, memory layout and cancellation.

Only `gearchaos.flow` imports this package. Every function that Numba compiles is below this folder, so that a hash
of its files tells whether the kernels cached on disk are up to date (`compilation.py`).

Conventions of all kernels
--------------------------
lane
    One trajectory that is being advanced.
step grid
    The division of a mesh period into steps. Steps with the same matrices have one *entry* in the step tables.
pack
    `WIDTH` lanes with the same step grid. They are advanced together, one vector instruction for all.
slot
    The place in memory of a pack that is being advanced; B = slots * `WIDTH` lanes in all.
tick
    The time in which the packs in all slots make one step each. Packs need not be at the same step of their periods.
housekeeping
    What is needed between some steps of a pack: samples, orthonormalisation, results, the next pack, step matrices.
suspect
    A lane whose contact state may have changed in a step. Its affine step is discarded and *resolved*: repeated with
    Taylor polynomials, from contact switch to contact switch.
segment
    The motion between two contact switches, or between a switch and an end of the step.
matrix buffer
    The step matrices of the lanes of a slot for one entry of the step tables, each for its lane's contact state.
position
    The number of a lane within its pack, 0 to `WIDTH` - 1.
dims
    A tuple of d integers. Its values are not used; its *type* makes the number of coordinates d known to the compiler,
    which unrolls the loops over coordinates.
vector
    `WIDTH` floats, one for each lane of a pack (`vector/simd.py`). Row r of a flat array of vectors is the floats
    r * `WIDTH` to (r + 1) * `WIDTH` - 1; element l of a row belongs to the lane at position l.
ws
    The rows of a `Workspace`, a flat array of vectors in the order of `Rows`.
parity
    0 or 1: states at even and at odd ticks have separate memory, so that a step reads one and writes the other.
"""
