"""The processor for which Numba compiles the kernels."""

from __future__ import annotations

from dataclasses import dataclass

import llvmlite.binding as llvm
from numba import config

_REGISTERS = (("avx512f", "AVX-512", 512), ("avx2", "AVX2", 256), ("avx", "AVX", 256), ("neon", "NEON", 128),
              ("sse2", "SSE2", 128))
"""Features of processors with vector instructions for 64-bit floats: LLVM's name, the usual one, bits of a register."""


@dataclass(frozen=True)
class Processor:
    """What the kernels are compiled for.

    Attributes
    ----------
    name : str
        The processor by LLVM's name, e.g. "znver4"; "generic" if Numba is told so.
    instruction_set : str
        The widest vector instructions, e.g. "AVX2"; "unknown" if LLVM names none that is known here.
    vector_bits : int
        The width of their registers; 0 if unknown. A pack of lanes takes 512 bits.
    fma : bool
        Whether a product and a sum are one instruction. Without it the kernels compute them by a slow function.

    Examples
    --------
    >>> Processor("znver4", "AVX-512", 512, True).vector_bits
    512
    """

    name: str
    instruction_set: str
    vector_bits: int
    fma: bool


def processor() -> Processor:
    """The processor of this machine, or the one that NUMBA_CPU_NAME and NUMBA_CPU_FEATURES say.

    Returns
    -------
    Processor

    Examples
    --------
    >>> processor() == processor()
    True
    """
    found = {name for name, there in llvm.get_host_cpu_features().items() if there}
    if config.CPU_FEATURES is not None:
        found = {f[1:] for f in config.CPU_FEATURES.split(",") if f.startswith("+")}
    name, bits = next(((name, bits) for feature, name, bits in _REGISTERS if feature in found), ("unknown", 0))
    fma = bool(found & {"fma", "neon", "fullfp16"})
    return Processor(config.CPU_NAME or llvm.get_host_cpu_name(), name, bits, fma)
