"""Commands that are ended by signals: one message, an exit code, and no process that goes on."""

import os
import signal
import subprocess
import sys
from contextlib import contextmanager, suppress

import psutil
import pytest

from tests.slow.instant import wait_until

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="sends POSIX signals")
MAIN = """
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)  # a background job inherits that it is ignored
"""
COMMAND = MAIN + "if __name__ == '__main__':\n    from gearchaos.cli import main; main()"
DEAF = MAIN + """
import sys, time, weakref
from gearchaos.cli.interrupts import ended_by_signals, finish_what_is_under_way

class Object:
    pass

def lost():
    one = Object()
    kept = weakref.ref(one, lambda _: (print("ready", flush=True), time.sleep(600)))
    del one

def raised():
    print("ready", flush=True)
    time.sleep(600)

def caught():
    try:
        print("ready", flush=True)
        time.sleep(600)
    except KeyboardInterrupt:
        print("caught", flush=True)

with ended_by_signals():
    if sys.argv[2] == "wait":
        finish_what_is_under_way()
    {"lost": lost, "raised": raised, "caught": caught}[sys.argv[1]]()
    time.sleep(600)
"""


IMPORTING = MAIN + """
import sys

class Interrupt:
    def find_spec(self, name, *_):
        if name == wanted:
            try:
                signal.raise_signal(signal.SIGINT)
            finally:
                print("undone", flush=True)

sys.argv[1:], wanted = ["--help"], sys.argv[1]
sys.meta_path.insert(0, Interrupt())
from gearchaos.__main__ import main; main()
"""


@contextmanager
def started(program, *arguments, **variables):
    with subprocess.Popen([sys.executable, "-c", program, *arguments], stdin=subprocess.DEVNULL, text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=os.environ | variables) as process:
        try:
            yield process
        finally:
            process.kill()


def runs(process):
    """Whether a process goes on; one that has ended may still have an entry, until somebody asks for its exit code."""
    with suppress(psutil.NoSuchProcess):
        return process.status() != psutil.STATUS_ZOMBIE
    return False


SIGNALS = [(signal.SIGINT, 130, "interrupted\n"), (signal.SIGTERM, 143, "terminated\n")]


@pytest.mark.parametrize(("imported", "said"),
                         [("typer", ""), ("gearchaos.cli.proofs", ""), ("rich.table", "undone\n")])
def test_ctrl_c_while_a_command_is_imported_is_one_message(imported, said):
    """The last one is imported by a command, which undoes what it has begun."""
    with started(IMPORTING, imported) as process:
        assert process.communicate(timeout=300) == (said, "interrupted\n")
        assert process.returncode == 130


@pytest.mark.parametrize("how", ["lost", "raised", "caught"])
@pytest.mark.parametrize(("number", "code", "said"), SIGNALS, ids=["SIGINT", "SIGTERM"])
def test_a_signal_ends_a_process_where_no_command_meets_it(number, code, said, how):
    """It is raised between commands, or lost in the callback of a weak reference, as in the garbage collector's."""
    with started(DEAF, how, "") as process:
        assert process.stdout.readline() == "ready\n"
        process.send_signal(number)
        assert process.communicate(timeout=300)[1] == said
        assert process.returncode == code


def test_what_is_under_way_is_waited_for_until_a_second_signal():
    with started(DEAF, "caught", "wait") as process:
        assert process.stdout.readline() == "ready\n"
        process.send_signal(signal.SIGTERM)
        assert process.stdout.readline() == "caught\n"
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait(2)
        process.send_signal(signal.SIGTERM)
        assert process.communicate(timeout=300)[1] == (
            "waiting for what is under way; the same again ends at once\nterminated\n")
        assert process.returncode == 143


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL], ids=lambda number: number.name)
@pytest.mark.parametrize("command", ["warmup", "regime"])
def test_no_process_that_compiles_outlives_its_command(tmp_path, number, command):
    """Those of `regime` compile the other kernels beside the first one; each would take half a minute.

    One that ends while Python still reads what it is to do says so itself, so both are at work before: the thread that
    watches the parent process is there.
    """
    with started(COMMAND, command, NUMBA_CACHE_DIR=str(tmp_path)) as process:
        def at_work():
            every = psutil.Process(process.pid).children(recursive=True)
            return [child for child in every if child.num_threads() > 1]

        wait_until(lambda: len(at_work()) >= 2)
        children = psutil.Process(process.pid).children(recursive=True)
        process.send_signal(number)
        said = process.communicate(timeout=300)[1].splitlines()
        assert process.returncode == (143 if number == signal.SIGTERM else -number)
        assert number == signal.SIGKILL or said[-1] == "terminated"
        assert all("compiling" in line for line in said if line != "terminated"), "and no warning of Python's"
        wait_until(lambda: not any(map(runs, children)))


def test_a_process_ends_with_the_one_that_started_it():
    code = ("import subprocess, time; from gearchaos.processes import python_command\n"
            "child = subprocess.Popen(python_command('import time; time.sleep(600)'))\n"
            "print(child.pid, flush=True); time.sleep(600)")
    with started(code) as parent:
        child = psutil.Process(int(parent.stdout.readline()))
        parent.kill()
        wait_until(lambda: not runs(child))


def test_the_process_that_forks_workers_ends_while_it_imports(tmp_path):
    (tmp_path / "slow.py").write_text("import os, time\nprint(os.getpid(), flush=True)\ntime.sleep(600)")
    code = ("from gearchaos.execute.pools import process_pool\n"
            "with process_pool(1, ['slow'])() as pool:\n    list(pool.results(abs, [1]))")
    with started(code, PYTHONPATH=os.pathsep.join([str(tmp_path), *sys.path])) as parent:
        child = psutil.Process(int(parent.stdout.readline()))
        assert "forkserver" in str(child.cmdline())
        parent.kill()
        wait_until(lambda: not runs(child))
