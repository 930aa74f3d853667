"""An S3 server for tests: that of the package moto, in a process of its own, on a free port of this machine."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tests import ROOT

BUCKET = "bucket"
"""Name of the bucket that the server has."""


@contextmanager
def s3_server(folder: Path) -> Iterator[dict[str, str]]:
    """A server with an empty bucket; gives the environment variables that lead to it. Its log is in ``folder``."""
    with open(folder / "server.log", "wb") as log:
        process = subprocess.Popen([sys.executable, "-m", "tests.object_server"], stdout=subprocess.PIPE, stderr=log,
                                   cwd=ROOT)
    try:
        assert process.stdout is not None
        variables = environment(int(process.stdout.readline()))
        url = f"{variables['AWS_ENDPOINT_URL']}/{BUCKET}"
        urllib.request.urlopen(urllib.request.Request(url, method="PUT"), timeout=30).close()
        yield variables
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


def environment(port: int) -> dict[str, str]:
    """The environment variables for a server on a port of this machine, none of which leads to another one."""
    own = f"http://127.0.0.1:{port}"
    return {
        "AWS_ACCESS_KEY_ID": "user", "AWS_SECRET_ACCESS_KEY": "secret", "AWS_REGION": "us-east-1",
        "AWS_ALLOW_HTTP": "true", "AWS_ENDPOINT_URL": own, "AWS_METADATA_ENDPOINT": "http://127.0.0.1:1"}


class _Serialised:
    """An application that handles one writing request at a time.

    moto checks the condition of a write and writes in two steps, between which another thread could write; S3 does both
    at once.
    """

    def __init__(self, application) -> None:
        self._application, self._lock = application, threading.Lock()

    def __call__(self, environ, start_response):
        if environ["REQUEST_METHOD"] in ("GET", "HEAD"):
            return self._application(environ, start_response)
        with self._lock:
            return self._application(environ, start_response)


def _serve() -> None:
    """Serve until the process is killed; the first line of output is the port."""
    import logging

    os.environ["MOTO_S3_DEFAULT_KEY_BUFFER_SIZE"] = str(2**30)  # objects stay in memory
    from moto.server import DomainDispatcherApplication, create_backend_app
    from werkzeug.serving import make_server

    logging.getLogger("werkzeug").setLevel(logging.ERROR)  # no line for each request
    server = make_server("127.0.0.1", 0, _Serialised(DomainDispatcherApplication(create_backend_app)), threaded=True)
    print(server.port, flush=True)
    server.serve_forever()


if __name__ == "__main__":
    _serve()
