"""The compiled part of the flow, and what it needs: compilation, vector types, memory and cancelling.

Only `gearchaos.flow` imports this package. Every function that Numba compiles is in here, so that one hash of this
folder tells whether the kernels on disk are still those of the sources (`compilation.py`).

Conventions of all kernels
--------------------------
lane
    One trajectory in a kernel call.
pack
    `WIDTH` lanes that share a step grid. They are advanced together, one vector instruction for all.
slot
    The place in memory of a pack that is being advanced; B = slots * `WIDTH` lanes in all.
position
    The number of a lane within its pack, 0 to `WIDTH` - 1.
dims
    A tuple of d integers. Its values are not used; its *type* makes the number of coordinates d known to the compiler,
    which unrolls the loops over coordinates.
vector
    `WIDTH` floats, one for each lane of a pack (`simd.py`). Row r of a flat array of vectors is the floats
    r * `WIDTH` to (r + 1) * `WIDTH` - 1; element l of a row belongs to the lane at position l.
ws
    The rows of a `Workspace`, a flat array of vectors in the order of `offsets.Rows`.
parity
    0 or 1: states at even and at odd ticks of the clock have memory of their own, so that a step reads one and writes
    the other.
"""
