"""Which machine computes: for the record in a store."""

from __future__ import annotations

import os
import platform
import socket
from typing import Any


def name() -> str:
    """The machine and the process on it."""
    return f"{socket.gethostname()}:{os.getpid()}"


def machine() -> dict[str, Any]:
    """The machine in words."""
    return {"system": platform.platform(), "processor": platform.machine(), "cores": os.cpu_count(),
            "python": platform.python_version()}
