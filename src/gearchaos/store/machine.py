"""The machine and the process that compute, as recorded in a store."""

from __future__ import annotations

import os
import platform
import socket
from typing import Any


def process_name() -> str:
    """Host name and process number, "host:pid"."""
    return f"{socket.gethostname()}:{os.getpid()}"


def machine() -> dict[str, Any]:
    """Operating system, processor architecture, number of cores and Python version."""
    return {"system": platform.platform(), "processor": platform.machine(), "cores": os.cpu_count(),
            "python": platform.python_version()}
