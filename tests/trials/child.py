"""The process that tries commands: one JSON line in for each, one out with its exit code and the seconds it took.

It runs them as a shell would, one after another, so that packages load once. After each, a zero byte ends what it wrote
to stdout and to stderr.
"""

import json
import os
import resource
import sys
import time
import traceback
import warnings


def main(answers: int) -> None:
    for line in sys.stdin:
        begin = time.monotonic()
        code = _run(json.loads(line))
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
            os.write(stream.fileno(), b"\0")
        os.write(answers, json.dumps({"code": code, "seconds": time.monotonic() - begin}).encode() + b"\n")


def _run(request: dict) -> int | str:
    """The exit code of a command in its folder, with files no larger than it may write."""
    from gearchaos.cli import app

    home, limits = os.getcwd(), resource.getrlimit(resource.RLIMIT_FSIZE)
    _warn_each_time()
    os.chdir(request["folder"])
    try:
        if request["largest"] is not None:  # what writes more gets an error, as on a full disk
            resource.setrlimit(resource.RLIMIT_FSIZE, (request["largest"], limits[1]))
        app(request["command"], prog_name="gearchaos")
    except SystemExit as end:
        return end.code or 0
    except BaseException:
        traceback.print_exc()
        return 1
    finally:
        if "matplotlib.pyplot" in sys.modules:
            sys.modules["matplotlib.pyplot"].close("all")  # the end of a process does that, too
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        os.chdir(home)
    return 0


def _warn_each_time() -> None:
    """As a process of its own would, for which every warning is the first."""
    warnings.resetwarnings()
    warnings.simplefilter("always")
    for quiet in (DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning):
        warnings.simplefilter("ignore", quiet)


if __name__ == "__main__":
    main(int(sys.argv[1]))
