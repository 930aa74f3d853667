"""What happens to a tile and a run when its pool fails: without processes or clusters, which are in test_runs."""

import os
import sys
from concurrent.futures import BrokenExecutor, Future
from types import SimpleNamespace

import pytest

from gearchaos.errors import InputError
from gearchaos.execute import pools
from gearchaos.execute.pool import Pool, PoolLostError, Submitted
from gearchaos.store.running.coordinator import result_of


def ended(result=None, error=None):
    future = Future()
    future.set_result(result) if error is None else future.set_exception(error)
    return future


@pytest.mark.parametrize(("future", "words"), [
    (ended("an entry"), "an entry"), (ended("ValueError: no"), "ValueError: no"),
    (ended(error=KeyError("x")), "KeyError: 'x'"),
    (ended(error=BrokenExecutor()), "the process that computed it died"),
])
def test_what_concerns_one_tile_is_told_in_words(future, words):
    assert result_of(future) == words


def cancelled():
    future = Future()
    future.cancel()
    return future


@pytest.mark.parametrize("future", [
    cancelled(), ended(error=ConnectionResetError("gone")), ended(error=type("CommClosedError", (Exception,), {})()),
])
def test_a_cluster_that_is_gone_ends_the_run(future):
    with pytest.raises(PoolLostError, match=r"the cluster is gone\. What is done is kept"):
        result_of(future)


def test_a_store_that_cannot_be_written_to_ends_the_run():
    with pytest.raises(OSError, match=r"no space\. What is done is kept"):
        result_of(ended(error=OSError("no space")))


@pytest.mark.parametrize(("max_pending", "submitted"), [(None, 14), (lambda: 1, 1)])
def test_a_pool_is_given_twice_as_many_items_as_it_computes_at_once_unless_told_otherwise(max_pending, submitted):
    given = []
    executor = SimpleNamespace(submit=lambda work, item: given.append(item) or ended(item))
    results = Pool(executor, lambda: 7).results(str, range(50), max_pending)
    next(results)
    assert given == list(range(submitted))


class Later:
    """An executor whose futures end when they are told to."""

    def __init__(self):
        self.futures = []

    def submit(self, work, *arguments):
        self.futures.append(Future())
        return self.futures[-1]


def test_all_that_has_ended_is_given_at_once_and_nothing_twice():
    executor = Later()
    submitted = Submitted(Pool(executor, lambda: 2))
    for item in "abcd":
        submitted.add(item, str)
    for number in (2, 0):
        executor.futures[number].set_result(number)
    assert [(item, future.result()) for item, future in submitted.ended(0.0)] == [("c", 2), ("a", 0)]
    assert submitted.ended(0.0) == [] and len(submitted) == 2


def test_the_results_of_many_workers_are_found_without_looking_at_all():
    """A future that has not ended is not asked: the time does not depend on the number of workers."""
    executor = Later()
    results = Pool(executor, lambda: 4000).results(str, range(20_000))
    asked = []

    class Silent(Future):
        def done(self):
            asked.append(self)
            return super().done()

    def submit(work, item):
        executor.futures.append(Silent())
        if len(executor.futures) == 8000:
            executor.futures[5000].set_result(None)
        return executor.futures[-1]

    executor.submit = submit
    assert next(results)[0] == 5000 and len(executor.futures) == 8000 and not asked


def test_items_begin_in_the_order_in_which_they_were_submitted(monkeypatch):
    monkeypatch.setattr(pools.time, "monotonic", lambda: now[0])
    now, executor = [0.0], Later()
    submitted = Submitted(Pool(executor, lambda: 2))
    for item in "abcd":
        submitted.add(item, str)
    assert submitted.idle == 0
    now[0] = 10
    assert submitted.longer_than(9.0) == ["a", "b"] and submitted.longer_than(10.0) == []
    executor.futures[1].set_result(None)
    submitted.ended(0.0)  # "c" begins
    now[0] = 15
    assert submitted.longer_than(4.0) == ["a", "c"] and submitted.longer_than(6.0) == ["a"]
    assert submitted.withdraw({"a", "c", "d"}) == ["d"]  # the others have begun
    executor.futures[0].set_result(None)
    executor.futures[2].set_result(None)
    assert [item for item, _ in submitted.ended(0.0)] == ["a", "c"]
    assert len(submitted) == 0 and submitted.idle == 2
    now[0] = 99
    assert submitted.longer_than(1.0) == []  # "d" was withdrawn


def test_workers_of_a_cluster_are_counted_from_time_to_time():
    counted = []
    client = SimpleNamespace(
        status="running", get_executor=lambda pure: None, nthreads=lambda: counted.append(1) or {"a": 2, "b": 3}
    )
    pool = pools._dask_pool(client)
    assert [pool.workers() for _ in range(50)] == [5] * 50 and len(counted) == 1
    assert pool.stop is not None and pool.check() is None


def test_threads_of_this_process_cannot_be_stopped():
    with pools.thread_pool(1)() as pool:
        assert pool.stop is None


@pytest.mark.parametrize(("module", "package", "options"), [
    ("distributed", "distributed", {"scheduler": "tcp://nowhere"}),
    ("distributed", "distributed", {"cluster": "slurm"}), ("dask_jobqueue", "dask-jobqueue", {"cluster": "slurm"})])
def test_a_package_for_clusters_that_is_missing_is_named_with_what_installs_it(monkeypatch, module, package, options):
    monkeypatch.setitem(sys.modules, module, None)
    message = rf'^cluster needs the package {package}; .* Run: pip install "gearchaos\[cluster\]"'
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


def test_threads_share_the_cores_that_few_tiles_leave():
    with pools.thread_pool(6)() as pool:
        assert pool.workers() == 6
        assert [pool.threads_per_item(tiles) for tiles in (1, 2, 3, 4, 6, 50)] == [6, 3, 2, 1, 1, 1]


def test_worker_processes_have_the_present_environment(monkeypatch):
    """Also if the process from which they are forked was started before."""
    for value in ("before", "now"):
        monkeypatch.setenv("GEARCHAOS_TEST", value)
        with pools.process_pool(1)() as pool:
            assert pool.submit(os.getenv, "GEARCHAOS_TEST").result() == value
