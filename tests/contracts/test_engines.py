"""What happens to a tile and a run when its pool fails: without processes or clusters, which are in test_runs."""

from concurrent.futures import BrokenExecutor, Future
from types import SimpleNamespace

import pytest

from gearchaos.errors import InputError
from gearchaos.execute import pools
from gearchaos.store.run import _error


def ended(result=None, error=None):
    future = Future()
    future.set_result(result) if error is None else future.set_exception(error)
    return future


@pytest.mark.parametrize(("future", "words"), [
    (ended(), None), (ended("ValueError: no"), "ValueError: no"), (ended(error=KeyError("x")), "KeyError: 'x'"),
    (ended(error=BrokenExecutor()), "the process that computed it died"),
])
def test_what_concerns_one_tile_is_told_in_words(future, words):
    assert _error(future) == words


def cancelled():
    future = Future()
    future.cancel()
    return future


@pytest.mark.parametrize("future", [
    cancelled(), ended(error=ConnectionResetError("gone")), ended(error=type("CommClosedError", (Exception,), {})()),
])
def test_a_cluster_that_is_gone_ends_the_run(future):
    with pytest.raises(pools.PoolLostError, match=r"the cluster is gone\. What is done is kept"):
        _error(future)


def test_a_store_that_cannot_be_written_to_ends_the_run():
    with pytest.raises(OSError, match=r"no space\. What is done is kept"):
        _error(ended(error=OSError("no space")))


@pytest.mark.parametrize(("max_pending", "submitted"), [(None, 14), (lambda: 1, 1)])
def test_a_pool_is_given_twice_as_many_items_as_it_computes_at_once_unless_told_otherwise(max_pending, submitted):
    given = []
    executor = SimpleNamespace(submit=lambda work, item: given.append(item) or ended(item))
    results = pools.Pool(executor, lambda: 7).results(str, range(50), max_pending)
    next(results)
    assert given == list(range(submitted))


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
