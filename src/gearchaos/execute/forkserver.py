"""What the process that forks workers imports first: it ends with its parent even while it imports, for seconds.

Afterwards it notices by itself. A timer looks, no thread as in `gearchaos.processes`, since the process forks.
"""

import os
import signal

_INTERVAL = 0.2  # seconds between two looks
_parent = os.getppid()


def _look(*_: object) -> None:
    if os.getppid() != _parent:
        os._exit(1)


signal.signal(signal.SIGALRM, _look)
signal.setitimer(signal.ITIMER_REAL, _INTERVAL, _INTERVAL)
