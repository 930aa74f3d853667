"""Names of the server that a ``Host`` header may contain."""

from __future__ import annotations

import ipaddress
import re
import socket

LOCAL = ("127.0.0.1", "localhost", "::1")
"""Names of this machine that only this machine can reach."""

_HOST = re.compile(r"(?P<name>[a-z0-9._-]+|\[[0-9a-f:.]+\])(:[0-9]{1,5})?")


def own_host(header: str, host: str) -> bool:
    """Whether a ``Host`` header names a server that listens at ``host``; the port is ignored, since tunnels change it.

    If the server listens at an address that other machines can reach, every IP address is accepted: DNS rebinding needs
    a name.
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
