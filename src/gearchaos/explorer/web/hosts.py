"""Names by which a ``Host`` header may name the server."""

from __future__ import annotations

import ipaddress
import re
import socket

LOCAL = ("127.0.0.1", "localhost", "::1")
"""Names of this machine that only this machine can reach."""

_HOST = re.compile(r"(?P<name>[a-z0-9._-]+|\[[0-9a-f:.]+\])(:[0-9]{1,5})?")


def own_host(header: str, host: str) -> bool:
    """Whether a ``Host`` header names a server that listens at ``host``; the port is ignored, since tunnels change it.

    If the server listens at an address that other machines reach, every IP address is accepted: only a name can be
    made to point to another machine (DNS rebinding).
    """
    match = _HOST.fullmatch(header.lower())
    if match is None:
        return False
    name = match["name"].strip("[]")
    if host in LOCAL:
        return name in LOCAL
    return name in (host.lower(), "localhost", socket.gethostname().lower()) or _is_address(name)


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True
