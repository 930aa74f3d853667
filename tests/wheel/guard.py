"""Copied into the environment of a trial as ``sitecustomize.py``: ends a process that leaves the wheel's own world.

It fails when a process opens or lists a file below the folder GUARDED, or connects to a host that is not this machine.
"""

import ipaddress
import os
import sys

_FOLDER = os.environ["GUARDED"] + os.sep
_FILES = ("open", "os.listdir", "os.scandir", "import")


def _end(what: str) -> None:
    os.write(2, f"Traceback: the wheel must not {what}\n".encode())
    os._exit(99)


def _local(address: object) -> bool:
    """Whether an address is one of this machine; addresses of sockets in the file system are."""
    if not isinstance(address, tuple):
        return True
    try:
        return ipaddress.ip_address(address[0]).is_loopback
    except ValueError:
        return address[0] in ("localhost", "")


def _watch(event: str, arguments: tuple) -> None:
    if event in _FILES:
        if any(isinstance(a, str) and a.startswith(_FOLDER) for a in arguments):
            _end(f"use {arguments}")
    elif event == "socket.connect" and not _local(arguments[1]):
        _end(f"connect to {arguments[1]}")
    elif event == "socket.getaddrinfo" and arguments[0] not in (None, "", "localhost", "127.0.0.1", "::1"):
        _end(f"look up {arguments[0]}")


sys.addaudithook(_watch)
