"""A chaotic set that several tests share."""

from functools import cache

import gearchaos as gc

CHAOTIC = {"omega": 1.6, "q0": 0.1, "eps1": 0.12}


@cache
def robust_chaos():
    """It, proved for every eps1 within 1e-6 of its value."""
    return gc.prove_chaos(gc.MeshModel.of(**CHAOTIC), tolerances={"eps1": 1e-6})
