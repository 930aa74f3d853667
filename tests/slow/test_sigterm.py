"""A run that a scheduler ends by SIGTERM leaves no lock, which would keep other hosts out."""

import json
import os
import signal
import subprocess
import sys
import time

from typer.testing import CliRunner

from gearchaos.cli import app

STUDY = """
[model]
q0 = 0.1
[study]
kind = "zones"
x = "omega=0.6:0.8:200"
y = "eps1=0.25:0.3:200"
"""


def test_sigterm_is_an_interrupt_of_a_run(tmp_path):
    (tmp_path / "study.toml").write_text(STUDY)
    store = tmp_path / "map.zarr"
    command = [sys.executable, "-c", "from gearchaos.cli import main; main()", "run", "study.toml", "--out", str(store),
               "--tile", "64", "--threads", "1"]
    with open(tmp_path / "said", "w") as said, subprocess.Popen(command, cwd=tmp_path, stderr=said) as process:
        deadline = time.monotonic() + 300
        while not list(store.glob("run/tiles/*/*")) and process.poll() is None and time.monotonic() < deadline:
            time.sleep(0.05)
        assert len(list(store.glob("run/locks/*"))) == 1
        os.kill(process.pid, signal.SIGTERM)
    assert process.returncode == 130 and (tmp_path / "said").read_text().rstrip().endswith("interrupted")
    assert not list(store.glob("run/locks/*"))
    found = json.loads(CliRunner().invoke(app, ["info", str(store), "--json"]).stdout)
    assert found["running"] == [] and found["tiles_done"] > 0 and not found["finished"]
