"""The run-up that a page plays: its result, and the sound of its mesh force."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import xarray as xr

from gearchaos.errors import InputError
from gearchaos.explorer.core.progress import Progress, with_progress
from gearchaos.explorer.core.run import Run
from gearchaos.model import MeshModel
from gearchaos.sound import write_wav
from gearchaos.studies.core.axis import Axis
from gearchaos.studies.core.options import RANGE
from gearchaos.studies.runup.runup import RunUp


@dataclass(frozen=True)
class RunUpResult:
    """A run-up, and its sound as a WAV file; empty if none was asked for."""

    dataset: xr.Dataset
    sound: bytes


def run_up(model: MeshModel, run: Run, mesh: str) -> Generator[Progress | RunUpResult]:
    """How far it is, again and again, then the run-up of a model, of a train that of a mesh."""
    speed = Axis("speed", run.start, run.stop, RANGE)
    study = RunUp(model.with_values({"speed": run.start}), speed=speed, duration=run.duration, down=run.way == "down",
                  signal=run.sound, mesh=mesh or None)
    found = yield from with_progress(partial(study.run, progress=True))
    sound = _wav(found) if run.sound else b""
    yield RunUpResult(found.drop_dims("instant", errors="ignore"), sound)


def _wav(dataset: xr.Dataset) -> bytes:
    """The sound as a file, empty if nothing is heard since the force does not vary."""
    with TemporaryDirectory() as folder, suppress(InputError):
        write_wav(dataset, path := Path(folder) / "runup.wav")
        return path.read_bytes()
    return b""
