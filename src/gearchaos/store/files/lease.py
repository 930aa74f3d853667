"""Locks in object stores: an object that says who holds the lock and until when.

It is taken, renewed and given back by conditional writes, so that of several processes one succeeds. A holder that ends
without giving it back keeps it until it expires, but other processes of its machine see that it has ended and take it
at once. Clocks of machines should agree within half a minute. A holder that was cut off for so long that another one
took its lock cannot append to a file to which that one has appended: appending is conditional too.
"""

from __future__ import annotations

import json
import os
import platform
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any
from uuid import uuid4

from filelock import Timeout

from gearchaos.store.files.object_client import Connection, condition_errors, errors_as_os_errors, obstore
from gearchaos.store.files.parsing import parse_as

DURATION = 60.0
"""How long a lease is valid after it was taken or renewed, in seconds."""

RENEWAL = 15.0
"""Time between renewals in seconds."""

_POLL = 0.5
"""Time between attempts at a lease that is held, in seconds."""


class LeaseHeldError(Timeout):
    """A lock that another process holds; its text says which and until when."""

    def __init__(self, name: str, holder: str) -> None:
        super().__init__(name)
        self.holder = holder

    def __str__(self) -> str:
        return f"{self.lock_file} is held by {self.holder}"

    def __reduce__(self):
        return type(self), (self.lock_file, self.holder)


@dataclass(frozen=True)
class Lease:
    """The content of a lease object.

    Attributes
    ----------
    token : str
        Unique to one acquisition.
    machine : str
        Host name and process number of the holder, "host:pid".
    process : str
        Identifies the process on its machine, see `_process`; empty where that is not known.
    expires : float
        Seconds since the epoch; 0 if it was given back.
    renewals : int
        How often it was renewed.
    """

    token: str
    machine: str
    process: str
    expires: float
    renewals: int = 0

    @property
    def free(self) -> bool:
        """Whether it may be taken: it was given back, has expired, or its holder has ended."""
        return time.time() >= self.expires or _ended(self.process)

    @property
    def text(self) -> str:
        """Who holds it, and until when, for a message."""
        until = time.strftime("%Y-%m-%d %H:%M:%S UTC", time.gmtime(self.expires))
        return f"{self.machine}, until {until} unless it is renewed"


@contextmanager
def hold(connection: Connection, name: str, where: str, timeout: float) -> Iterator[None]:
    """Hold the lease in the object ``name``, which a thread renews.

    Parameters
    ----------
    connection : Connection
    name : str
    where : str
        URL of the object, for messages.
    timeout : float
        For how many seconds to try if another process holds it; without limit if negative.

    Raises
    ------
    LeaseHeldError
        If another process holds it. It is a `filelock.Timeout`.
    OSError
        If the object store fails, or at the end if another process has taken the lease meanwhile.
    """
    with errors_as_os_errors(where):
        held = _Held(connection.quick, name, *_acquire(connection.quick, name, where, timeout))
    try:
        yield
    finally:
        held.give_back()
    if held.lost:
        raise OSError(f"{where}: the lock was lost to another process while this one could not renew it")


class _Held:
    """A lease that this process holds, and the thread that renews it."""

    def __init__(self, store: Any, name: str, lease: Lease, version: dict[str, str]) -> None:
        self.lost = False
        self._store, self._name, self._lease, self._version = store, name, lease, version
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._renew, name=f"renew {name}", daemon=True)
        self._thread.start()

    def give_back(self) -> None:
        """End the renewals and mark the lease as free; if that fails it expires."""
        self._end.set()
        self._thread.join()
        with suppress(Exception):  # if another process has taken the lease, its version has changed
            _put(self._store, self._name, replace(self._lease, expires=0.0), self._version)

    def _renew(self) -> None:
        while not self.lost and not self._end.wait(RENEWAL):
            lease = replace(self._lease, expires=time.time() + DURATION, renewals=self._lease.renewals + 1)
            try:
                self._version, self._lease = _put(self._store, self._name, lease, self._version), lease
            except condition_errors():
                self._compare()
            except Exception:
                continue  # the object store fails: try again until it works, or another process has taken the lease

    def _compare(self) -> None:
        """Find out whether another process has taken the lease, or a renewal was written but its answer was lost."""
        with suppress(Exception):
            found, version = _get(self._store, self._name)
            if found is not None and found.token == self._lease.token:
                self._lease, self._version = found, version
            else:
                self.lost = True


def _acquire(store: Any, name: str, where: str, timeout: float) -> tuple[Lease, dict[str, str]]:
    """Take a lease; returns it and the version of its object."""
    token, begun = uuid4().hex, time.monotonic()
    while True:
        found, version = _get(store, name)
        if found is not None and found.token == token:  # written, but the answer was lost
            return found, version
        if found is None or found.free:
            mine = Lease(token, f"{platform.node()}:{os.getpid()}", _process(os.getpid()), time.time() + DURATION)
            with suppress(*condition_errors()):  # another process was faster, or the answer was lost
                return mine, _put(store, name, mine, version)
        elif 0 <= timeout <= time.monotonic() - begun:
            raise LeaseHeldError(where, found.text)
        else:
            time.sleep(_POLL)


def _get(store: Any, name: str) -> tuple[Lease | None, dict[str, str]]:
    """The lease in an object, None if it holds none, and the version of the object, empty if there is none."""
    try:
        found = obstore().get(store, name)
    except FileNotFoundError:
        return None, {}
    version, content = version_of(found.meta), bytes(found.bytes())
    try:
        return parse_as(Lease, content), version
    except ValueError:  # not a lease
        return None, version


def _put(store: Any, name: str, lease: Lease, version: dict[str, str]) -> dict[str, str]:
    """Write a lease if its object has this version; returns the new version."""
    content = json.dumps(asdict(lease)).encode()
    return version_of(obstore().put(store, name, content, mode=version or "create"))


def version_of(found: Any) -> dict[str, str]:
    """The version of an object, as a condition for replacing it, from what obstore tells of the object."""
    return {key: found[key] for key in ("e_tag", "version") if found[key] is not None}


def _process(pid: int) -> str:
    """What identifies a process: boot of the machine, namespace of process numbers, number, and time of its start.

    Empty if there is no such process, if it has ended but its parent does not know yet, or on systems without /proc.
    """
    try:
        boot = Path("/proc/sys/kernel/random/boot_id").read_text().strip()
        namespace = os.readlink("/proc/self/ns/pid")
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return ""
    return "" if fields[0] in "ZX" else f"{boot} {namespace} {pid} {fields[19]}"


def _ended(process: str) -> bool:
    """Whether a process of this machine has ended; False for those of other machines."""
    own, theirs = _process(os.getpid()).split(), process.split()
    if len(theirs) != len(own) or not own or own[:2] != theirs[:2] or not theirs[2].isdecimal():
        return False
    return _process(int(theirs[2])) != process
