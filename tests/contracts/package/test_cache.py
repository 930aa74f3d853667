"""Compiled kernels on disk: every process hits them, none gets the wrong ones."""

import errno
import importlib.util
import io
import os
import pickle
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest
from filelock import FileLock
from numba import typeof

import gearchaos as gc
from gearchaos.flow import ExactFlow, exact, first_kernels, parallel_compilation, step_tables
from gearchaos.flow.kernels import compilation
from gearchaos.model import MeshModel, vary
from gearchaos.model.switched import switched_system

PROGRAM = """
import sys, time
from pathlib import Path
import numpy as np
from gearchaos.flow.kernels.compilation import kernel

@kernel
def twice(x):
    total = 0.0
    for value in x.flat:
        total += 2 * value
    return total

folder, name, count, chosen = Path(sys.argv[1]), sys.argv[2], int(sys.argv[3]), sys.argv[4].split(",")
if name == "endless":
    twice._compiler.compile = lambda *_: time.sleep(600)
(folder / ("here-" + name)).touch()
while len(list(folder.glob("here-*"))) < count:
    time.sleep(0.001)
print([twice(np.arange(5).astype(kind)) for kind in chosen], sum(twice.stats.cache_hits.values()))
"""


@pytest.fixture
def begin(tmp_path):
    """Start a process that waits until so many have begun, calls a kernel with numbers of these kinds, and prints what
    it found and how many kernels it loaded."""
    (tmp_path / "program.py").write_text(PROGRAM)
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}

    def start(name, count, *chosen):
        command = [sys.executable, tmp_path / "program.py", tmp_path, str(name), str(count), ",".join(chosen)]
        return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True)

    return start


@pytest.mark.slow
def test_processes_that_compile_at_once_do_not_spoil_the_cache_and_compile_each_kernel_once(begin):
    kinds = ("f8", "i8", "f8")
    together = [begin(number, len(kinds), kind) for number, kind in enumerate(kinds)]
    assert sorted(p.communicate(timeout=300)[0] for p in together) == ["[20.0] 0\n", "[20.0] 0\n", "[20.0] 1\n"]
    assert begin(0, 1, *kinds).communicate(timeout=300)[0] == "[20.0, 20.0, 20.0] 2\n"


@pytest.mark.slow
def test_a_process_killed_while_it_compiles_leaves_a_cache_that_works(begin, tmp_path):
    killed = begin("endless", 1, "f8")
    while not list(tmp_path.rglob(".*.lock")):
        assert killed.poll() is None
        time.sleep(0.01)
    killed.kill()
    killed.communicate()
    assert killed.returncode != 0 and not list(tmp_path.rglob("*.nbc"))
    assert begin(0, 1, "f8").communicate(timeout=60)[0] == "[20.0] 0\n"
    assert len(list(tmp_path.rglob("*.nbc"))) == 1


def test_a_process_does_not_wait_for_ever_for_another_one_to_compile(tmp_path, monkeypatch):
    monkeypatch.setattr(compilation, "cache_directory", lambda: tmp_path)
    monkeypatch.setattr(compilation, "LONGEST_WAIT", 0.1)

    def triple(x):
        return 3 * x

    assert compilation.kernel(triple)(2.0) == 6.0
    for written in tmp_path.rglob("*.nb?"):
        written.unlink()
    (lock,) = (path for path in tmp_path.glob(".*.lock") if path.name != ".lock")
    with FileLock(lock):
        assert compilation.kernel(triple)(2.0) == 6.0


def test_a_process_does_not_wait_for_itself_after_compiling_was_interrupted(tmp_path, monkeypatch):
    monkeypatch.setattr(compilation, "cache_directory", lambda: tmp_path)

    def quadruple(x):
        return 4 * x

    compiled = compilation.kernel(quadruple)
    with monkeypatch.context() as patch:
        patch.setattr(compiled._compiler, "compile", Mock(side_effect=KeyboardInterrupt))
        with pytest.raises(KeyboardInterrupt):
            compiled(2.0)
    acquired, acquire = [], FileLock.acquire
    monkeypatch.setattr(FileLock, "acquire", lambda lock, **options: (
        acquired.append(Path(lock.lock_file).name), acquire(lock, **options))[1])
    assert compiled(2.0) == 8.0
    assert acquired == [".lock"], "to write the kernel; the lock to compile it is held"


def test_the_cache_is_another_one_after_any_edit_or_move_of_a_kernel(tmp_path):
    (tmp_path / "compilation.py").write_bytes(Path(compilation.__file__).read_bytes())
    (tmp_path / "room").mkdir()
    (tmp_path / "kernel.py").write_text("# one\n")
    (tmp_path / "room" / "kernel.py").write_text("# other\n")

    def directory():
        spec = importlib.util.spec_from_file_location("copied", tmp_path / "compilation.py")
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module.cache_directory()

    before = directory()
    assert directory() == before
    found = {before}
    for path in (tmp_path / "kernel.py", tmp_path / "room" / "kernel.py"):
        with path.open("a") as file:
            file.write("# edited\n")
        found.add(directory())
    (tmp_path / "room").rename(tmp_path / "rooms")
    assert len(found | {directory()}) == 4


FIRST_RUN = """
import gearchaos as gc
from gearchaos.flow import compile_beside, on_compile
compile_beside()
on_compile(lambda: print("compiles"))
model = gc.MeshModel.of(q0=0.1, eps1=0.1)
print(%s)
"""


@pytest.mark.exhaustive  # it compiles all kernels of a first run
@pytest.mark.parametrize(("answer", "kernels"), [
    ("gc.regime(model)", 4), ("gc.branch(model, 'omega=0.9:1.1').event_value.values", 7)])
def test_a_first_run_loads_what_processes_beside_it_compiled(tmp_path, answer, kernels):
    """Each kernel is compiled once: from arguments of other types the processes would compile one that nobody uses."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    command = [sys.executable, "-c", FIRST_RUN % answer]
    first, second = (subprocess.run(command, env=environment, capture_output=True, text=True,
                                    timeout=600).stdout.splitlines() for _ in range(2))
    assert first.count("compiles") in (1, 2), first
    assert [line for line in first if line != "compiles"] == second != []
    assert len(list(tmp_path.rglob("*.nbc"))) == kernels


def test_a_process_beside_imports_nothing_from_where_it_is(monkeypatch, tmp_path):
    """A file of the user's may have the name of a module that is imported."""
    (tmp_path / "platformdirs.py").write_text("open('imported', 'w')\nraise SystemExit\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    parallel_compilation._start("advance", b"")
    assert not (tmp_path / "imported").exists()
    monkeypatch.setattr(sys, "executable", str(tmp_path / "nowhere"))
    parallel_compilation._start("advance", b"")  # is no error


def test_compiling_is_announced_once_for_a_kernel_with_its_subroutines_and_loading_is_not(tmp_path, monkeypatch):
    monkeypatch.setattr(compilation, "cache_directory", lambda: tmp_path)
    announced = []
    compilation.on_compile(lambda: announced.append(1))

    @compilation.subroutine
    def half(x):
        return x / 2

    def quarter(x):
        return half(half(x))

    for _ in range(2):
        assert compilation.kernel(quarter)(2.0) == 0.5 and announced == [1]


def test_a_cache_that_cannot_be_written_is_done_without(monkeypatch):
    monkeypatch.setattr(compilation, "cache_directory", lambda: Path("/proc/nowhere/sources"))
    monkeypatch.setattr(compilation, "_writable", compilation._writable.__wrapped__)
    assert compilation.kernel(lambda x: 5 * x)(2.0) == 10.0 and not compilation.cache_is_empty()


def test_on_a_full_disk_kernels_are_compiled_and_not_kept(tmp_path, monkeypatch):
    monkeypatch.setattr(compilation, "cache_directory", lambda: tmp_path)

    def sextuple(x):
        return 6 * x

    with monkeypatch.context() as full:
        no_space = OSError(errno.ENOSPC, "No space left")
        full.setattr(compilation.FunctionCache, "_save_overload", Mock(side_effect=no_space))
        compilation._warn_once.cache_clear()
        with pytest.warns(RuntimeWarning, match=f"kept in {tmp_path}: No space left. .* Free space") as said:
            assert compilation.kernel(sextuple)(2.0) == 12.0 == compilation.kernel(sextuple)(2) and len(said) == 1
    again = compilation.kernel(sextuple)
    assert again(2.0) == 12.0 and list(tmp_path.rglob("*.nbc"))


@pytest.fixture
def seen(monkeypatch):
    """The types with which the main kernel is asked for, and nothing computed."""
    types = set()
    monkeypatch.setattr(exact, "advance_packs", lambda *given: types.add(tuple(map(typeof, given))))
    return types


@pytest.mark.parametrize("lanes", [1, 9])
@pytest.mark.parametrize("options", [{}, {"sections": 3}, {"measured": True}, {"tangent": True, "growth": True}])
def test_one_compiled_kernel_serves_every_call(lanes, options, seen):
    """What `gearchaos warmup` compiles, from one lane, must be what a map runs."""
    flow = ExactFlow(switched_system(vary(MeshModel.of(kind="torsional"), {})))
    flow.advance(np.zeros((2, 1)), 1)
    tangent = np.zeros((2, 2, lanes)) if options.get("tangent") else None
    for periods in (5, np.arange(1, lanes + 1)):
        flow.advance(np.zeros((2, lanes)), periods, points=np.zeros(lanes, int), **options | {"tangent": tangent})
    assert len(seen) == 1


@pytest.fixture
def compile_in_this_process(monkeypatch):
    """What a process beside this one does, but for its end."""
    def compile_job(job, system):
        monkeypatch.setattr(sys, "stdin", SimpleNamespace(buffer=io.BytesIO(pickle.dumps(system))))
        first_kernels.main(job)

    monkeypatch.setattr(step_tables, "tabulate_steps", step_tables.tabulate_steps)  # which is replaced
    monkeypatch.setattr(os, "_exit", lambda code: None)
    return compile_job


def test_a_process_beside_compiles_the_kernel_of_a_motion(seen, compile_in_this_process):
    system = switched_system(vary(MeshModel.of(), {}))
    ExactFlow(system).advance(np.zeros((2, 1)), 1)
    compile_in_this_process("advance", system.take(np.zeros(1, int)))
    assert len(seen) == 1


@pytest.mark.parametrize(("job", "study"), [
    ("orbits", gc.regime), ("corrections", lambda model: gc.branch(model, "eps1=0.1:0.11"))])
def test_processes_beside_compile_no_kernel_that_a_study_lacks(job, study, compile_in_this_process, monkeypatch):
    model, others = MeshModel.of(eps1=0.1), []
    study(model)
    monkeypatch.setattr(compilation._SharedCache, "load_overload", lambda _, given, __: others.append(given))
    compile_in_this_process(job, switched_system(vary(model, {})).take(np.zeros(1, int)))
    assert others == []
