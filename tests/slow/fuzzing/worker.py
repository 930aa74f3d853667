"""The worker process of `runner`: reads one JSON request per command, answers with its exit code and duration in JSON.

It runs the commands one after another as a shell would, so that packages load once. After each command it writes a
zero byte to stdout and to stderr to mark the end of the output.
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
    """Run a command in its folder under its limit of file size; return the exit code."""
    from gearchaos.cli import app

    home, limits = os.getcwd(), resource.getrlimit(resource.RLIMIT_FSIZE)
    _warn_each_time()
    os.chdir(request["folder"])
    try:
        if request["largest"] is not None:  # writing more fails as it does on a full disk
            resource.setrlimit(resource.RLIMIT_FSIZE, (request["largest"], limits[1]))
        app(request["command"], prog_name="gearchaos")
    except SystemExit as end:
        return end.code or 0
    except BaseException:
        traceback.print_exc()
        return 1
    finally:
        if "matplotlib.pyplot" in sys.modules:
            sys.modules["matplotlib.pyplot"].close("all")  # as the end of a process would
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        os.chdir(home)
    return 0


def _warn_each_time() -> None:
    """Show every warning each time, as in a new process."""
    warnings.resetwarnings()
    warnings.simplefilter("always")
    for quiet in (DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning):
        warnings.simplefilter("ignore", quiet)


if __name__ == "__main__":
    main(int(sys.argv[1]))
