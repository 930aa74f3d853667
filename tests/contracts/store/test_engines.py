"""What happens to a tile and a run when its pool fails: without processes or clusters, which are in test_runs."""

import os
import shutil
import sys
from collections import deque
from concurrent.futures import BrokenExecutor, Future, ThreadPoolExecutor
from contextlib import nullcontext
from types import SimpleNamespace

import pytest

import gearchaos as gc
from gearchaos.errors import InputError
from gearchaos.execute import pools
from gearchaos.execute.pool import Pool, PoolLostError
from gearchaos.store.run import ATTEMPTS, _result, run_into_store
from tests.contracts.store.stores import MAP


def ended(result=None, error=None):
    future = Future()
    future.set_result(result) if error is None else future.set_exception(error)
    return future


def test_what_concerns_one_tile_is_told_in_words():
    assert [_result(ended("ValueError: no")), _result(ended([3]))] == [("", "ValueError: no"), ("", [3])]
    assert _result(ended(error=KeyError("x"))) == ("KeyError: 'x'", None)
    assert _result(ended(error=BrokenExecutor())) == ("the process that computed it died", None)


def test_a_cluster_that_is_gone_and_a_full_disk_end_the_run():
    (cancelled := Future()).cancel()
    errors = ConnectionResetError(), type("CommClosedError", (Exception,), {})()
    for future in (cancelled, *(ended(error=error) for error in errors)):
        with pytest.raises(PoolLostError, match=r"the cluster is gone\. What is done is kept"):
            _result(future)
    with pytest.raises(OSError, match=r"no space\. What is done is kept"):
        _result(ended(error=OSError("no space")))


class Executor:
    """One whose futures end as they are told: with the result of the work, an error, or not at all."""

    def __init__(self, *ends):
        self.ends, self.given, self.futures = list(ends), [], []

    def submit(self, work, item):
        end = self.ends.pop(0) if self.ends else None
        if end == "broken":
            raise BrokenExecutor
        self.given.append(item)
        self.futures.append(ended(work(item)) if end is None else Future() if end == "never" else ended(error=end))
        return self.futures[-1]


def test_a_pool_is_given_twice_as_many_items_as_it_computes_at_once_and_first_those_put_first():
    executor, first = Executor(), deque("ab")
    results = Pool(executor, lambda: 3).results(str, "cdefghi", first)
    found = [next(results)[0]]
    assert executor.given == list("abcdef")
    first.append("x")
    found += [item for item, _ in results]
    assert executor.given == list("abcdefxghi") and sorted(found) == list("abcdefghix")


def test_a_pool_that_breaks_gives_back_what_it_could_not_take():
    first, executor = deque(), Executor(None, BrokenExecutor(), "broken")
    found = dict(Pool(executor, lambda: 5).results(str, iter("abcdef"), first))
    assert executor.given == ["a", "b"] and list(first) == ["c"]
    assert found["a"].result() == "a" and isinstance(found["b"].exception(), BrokenExecutor)


def test_what_was_not_begun_is_cancelled_and_a_lost_pool_is_an_error():
    executor = Executor(None, "never", "never")
    results = Pool(executor, lambda: 2).results(str, range(3))
    assert next(results)[0] == 0
    results.close()
    assert [future.cancelled() for future in executor.futures] == [False, True, True]
    lost = Pool(Executor(), lambda: 1, lambda: _result(ended(error=ConnectionError())))
    with pytest.raises(PoolLostError, match="the cluster is gone"):
        next(lost.results(str, range(3)))


@pytest.mark.parametrize(("deaths", "failed"), [(1, {}), (99, {5: "the process that computed it died"})])
def test_tiles_of_a_pool_that_died_are_tried_alone(tmp_path, instant, deaths, failed):
    opened = []

    def submit(executor, work, item):
        if item == ("tile", 5) and len(opened) <= deaths:
            executor.ends = [BrokenExecutor(), *50 * ["broken"]]
        return Executor.submit(executor, work, item)

    def pool():
        opened.append(type("Dying", (Executor,), {"submit": submit})())
        return nullcontext(Pool(opened[-1], lambda: 2))

    outcome = run_into_store(MAP, tmp_path / "map.zarr", tile=8, pool=pool)
    assert (outcome.failed, outcome.done, outcome.finished) == (failed, 12 - len(failed), not failed)
    assert len(opened) == (2 + ATTEMPTS if failed else 4)  # one for the others, one for each attempt and the block


def test_workers_that_outlive_a_store_compute_another_study_in_its_place(tmp_path, instant):
    with ThreadPoolExecutor(1) as workers:  # as those of a Dask scheduler
        for study in (MAP, gc.Zones(MAP.model, "omega=0.5:1.1:10", MAP.y), MAP):
            shutil.rmtree(tmp_path / "map.zarr", ignore_errors=True)
            assert run_into_store(study, tmp_path / "map.zarr", tile=8,
                                  pool=lambda: nullcontext(Pool(workers, lambda: 1))).finished
            assert gc.load(tmp_path / "map.zarr").equals(gc.run(study))


def test_workers_of_a_cluster_are_counted_from_time_to_time():
    counted = []
    client = SimpleNamespace(
        status="running", get_executor=lambda **_: None, nthreads=lambda: counted.append(1) or {"a": 2, "b": 3})
    pool = pools._dask_pool(client)
    assert [pool.workers() for _ in range(50)] == [5] * 50 and len(counted) == 1
    assert pool.check() is None
    client.status = "closed"
    with pytest.raises(PoolLostError, match="the Dask scheduler is gone"):
        pool.check()


@pytest.mark.parametrize(("module", "options"), [
    ("distributed", {"scheduler": "tcp://nowhere"}), ("distributed", {"workers": 2}),
    ("dask_jobqueue", {"cluster": "slurm"})])
def test_a_package_for_clusters_that_is_missing_is_named_with_what_installs_it(monkeypatch, module, options):
    monkeypatch.setitem(sys.modules, module, None)
    message = rf'^cluster needs the package {module.replace("_", "-")}; .* Run: pip install "gearchaos\[cluster\]"'
    with pytest.raises(InputError, match=message):
        pools.pool_from_options(**options)


def test_slurm_is_refused_where_no_job_can_be_submitted(monkeypatch, tmp_path):
    pytest.importorskip("dask_jobqueue")
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(InputError, match=r"^cluster needs the command sbatch; .* leave out --cluster and --jobs\.$"):
        pools.pool_from_options(cluster="slurm", jobs=64)
    (tmp_path / "sbatch").touch(mode=0o755)
    pools.pool_from_options(cluster="slurm", jobs=64)


@pytest.mark.parametrize("error", [OSError("no answer"), ValueError("no address"), TimeoutError("late")])
def test_a_scheduler_that_does_not_answer_is_refused(monkeypatch, error):
    def client(address, **_):
        raise error

    monkeypatch.setattr(pools, "_distributed", lambda: SimpleNamespace(Client=client))
    with pytest.raises(InputError, match="scheduler must be a Dask scheduler that answers; got 'tcp://nowhere'"):
        pools.dask_workers("tcp://nowhere")


def test_threads_share_the_cores_that_few_tiles_leave_and_no_pool_has_no_width():
    for none in (pools.process_pool, pools.thread_pool, pools.local_cluster):
        with pytest.raises(InputError, match="must be a whole number of at least 1; got 0"):
            none(0)
    with pools.thread_pool(6)() as pool:
        assert pool.workers() == 6
        assert [pool.threads_per_item(tiles) for tiles in (1, 2, 3, 4, 6, 50)] == [6, 3, 2, 1, 1, 1]


def test_worker_processes_have_the_present_environment(monkeypatch):
    """Also if the process from which they are forked was started before."""
    for value in ("before", "now"):
        monkeypatch.setenv("GEARCHAOS_TEST", value)
        with pools.process_pool(1)() as pool:
            assert pool.submit(os.getenv, "GEARCHAOS_TEST").result() == value
