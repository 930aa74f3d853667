"""The bytes of one chunk, as the codecs of the layout define them, and the file it is kept in.

Zarr writes the same bytes (a test compares them), but its pipeline hands every chunk to and fro between threads: the 21
arrays of a tile of 16 384 cells take it 30 ms of CPU instead of 7 to 20. Reading and all metadata are left to Zarr.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import google_crc32c
import numpy as np
from numcodecs.zstd import Zstd
from zarr.codecs import Crc32cCodec, ZstdCodec

from gearchaos.files import write_bytes

_LEVEL = 1

CODECS = (ZstdCodec(level=_LEVEL), Crc32cCodec())
"""What becomes of a chunk's numbers after they are laid out as little-endian bytes; `_encoded` says it, too. A change
needs a new `FORMAT`: stores are gone on with."""


def chunk_file(array: Any, place: tuple[int, ...]) -> Path:
    """Where a Zarr array on disk keeps the chunk at this place of its grid."""
    return Path(array.store.root) / array.path / array.metadata.encode_chunk_key(place)


def write_chunk(array: Any, place: tuple[int, ...], values: np.ndarray) -> None:
    """Write a whole chunk, or at the ends of an array what there is of it.

    Raises OSError if it cannot be written, ValueError if the values have another shape.
    """
    shape = tuple(min(m, n - i * m) for i, m, n in zip(place, array.chunks, array.shape, strict=True))
    if values.shape != shape:
        raise ValueError(f"a chunk of shape {shape} is expected, not {values.shape}")
    file = chunk_file(array, place)
    file.parent.mkdir(parents=True, exist_ok=True)
    write_bytes(file, _encoded(_padded(array, values)))


def _padded(array: Any, values: np.ndarray) -> np.ndarray:
    """The chunk in its full shape; beyond the array's ends it is blank."""
    if values.shape == array.chunks:
        return np.asarray(values, array.dtype)
    full = np.full(array.chunks, array.fill_value, array.dtype)
    full[tuple(slice(n) for n in values.shape)] = values
    return full


def _encoded(values: np.ndarray) -> bytes:
    packed = Zstd(level=_LEVEL).encode(np.ascontiguousarray(values, values.dtype.newbyteorder("<")))
    return packed + google_crc32c.value(packed).to_bytes(4, "little")
