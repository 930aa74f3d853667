"""The mesh force of a run-up as sound."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gearchaos.dynamics.time_series import evenly
from gearchaos.errors import InputError
from gearchaos.execute.machine import check_memory
from gearchaos.files import check_target, write_bytes

if TYPE_CHECKING:
    import xarray as xr

RATE = 44_100  # samples per second of a file
_BYTES = 200  # of memory for each sample: four instants of 50 bytes
_SILENCE = 1e-6  # of the largest force: what varies by less is none


def check_sound(duration: float) -> None:
    """Raise `InputError` if the sound of a run of this duration, s, does not fit in the memory."""
    check_memory("samples of the sound", int(duration * RATE), _BYTES)


def write_wav(dataset: xr.Dataset, path: Path) -> float:
    """Write the mesh force of a run-up as a WAV file of 16 bits, and return how much of it full scale is.

    What is heard is the mesh force without its mean, the largest deviation at full scale; a run-down follows its
    run-up. The force is averaged over each of four times as many instants as the file has, and these are filtered.

    Parameters
    ----------
    dataset : Dataset
        From `gearchaos.runup` with ``signal=True``.
    path : Path

    Raises
    ------
    InputError
        If the Dataset has no signal, its force is constant or not a number, or the path cannot be written.
    """
    from scipy.io import wavfile  # here, since it takes a tenth of a second to load

    check_target("path", path)
    if "signal_force" not in dataset:
        raise InputError("dataset", "must be a result of runup with signal=True", str(dataset.attrs.get("study")))
    parts = []
    for time, force in zip(dataset["signal_time"].values, dataset["signal_force"].values, strict=True):
        known = np.isfinite(force)
        if np.count_nonzero(known) < 2:
            continue
        heard = evenly(time[known], force[known], RATE)[1]
        parts.append(heard - heard.mean())
    signal = np.concatenate([*parts, np.zeros(0)])
    largest = float(np.abs(signal).max(initial=0.0))
    if not largest > _SILENCE * np.nanmax(np.abs(dataset["signal_force"].values), initial=0.0):
        raise InputError("dataset", "must have a mesh force that varies", largest)
    buffer = io.BytesIO()
    wavfile.write(buffer, RATE, np.round(signal / largest * 32767).astype(np.int16))
    write_bytes(path, buffer.getvalue())
    return largest
