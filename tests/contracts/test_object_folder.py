"""Folders in object stores, tested with an S3 server and in memory: conditional writes, leases, errors in words."""

from __future__ import annotations

import json
import os
import pickle
import platform
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from uuid import uuid4

import numpy as np
import pytest
import xarray as xr
import zarr
from filelock import Timeout

from gearchaos.errors import InputError
from gearchaos.store.files import lease, object_client
from gearchaos.store.files.folder import Folder, open_folder
from gearchaos.store.files.object_folder import ObjectFolder
from tests.object_server import BUCKET, environment, s3_server

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, str]]:
    with s3_server(tmp_path_factory.mktemp("server")) as variables:
        yield variables


@pytest.fixture
def in_s3(server: dict[str, str], monkeypatch: pytest.MonkeyPatch) -> ObjectFolder:
    """An empty folder on the server."""
    use(server, monkeypatch)
    return ObjectFolder(f"s3://{BUCKET}/{uuid4().hex}/map.zarr")


def use(variables: dict[str, str], monkeypatch: pytest.MonkeyPatch) -> None:
    """Set these environment variables, and no others of the provider."""
    for name in [n for n in os.environ if n.startswith("AWS_")]:
        monkeypatch.delenv(name)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)


@pytest.fixture(params=["s3", "memory"])
def folder(request: pytest.FixtureRequest) -> ObjectFolder:
    """An empty folder on the server, and in memory."""
    if request.param == "s3":
        return request.getfixturevalue("in_s3")
    return ObjectFolder(f"memory://{uuid4().hex}/map.zarr")


@pytest.fixture(params=["s3", "memory", "local"])
def any_folder(request: pytest.FixtureRequest, tmp_path: Path) -> Folder:
    """An empty folder of each kind."""
    if request.param == "s3":
        return request.getfixturevalue("in_s3")
    return open_folder(tmp_path / "map" if request.param == "local" else f"memory://{uuid4().hex}/map.zarr")


def test_files_are_written_read_listed_and_deleted(any_folder: Folder) -> None:
    assert any_folder.size("a") is None and not any_folder.exists()
    any_folder.write("a", b"first")
    any_folder.write("a", memoryview(b"second"))
    any_folder.write("run/tiles/1", b"")
    any_folder.write("run/tilesets", b"1")
    assert any_folder.read("a") == b"second" and any_folder.size("a") == 6 and any_folder.exists()
    assert sorted(any_folder.list()) == [("a", 6), ("run/tiles/1", 0), ("run/tilesets", 1)]
    assert list(any_folder.list("run/tiles")) == [("run/tiles/1", 0)]
    any_folder.delete("a")
    any_folder.delete("a")
    any_folder.delete_tree("run/tiles")
    any_folder.delete_tree("none")
    assert list(any_folder.list()) == [("run/tilesets", 1)]


def test_parts_of_a_file_end_where_it_ends(any_folder: Folder) -> None:
    any_folder.write("a", b"0123456789")
    any_folder.write("empty", b"")
    parts = [(0, None), (3, None), (3, 4), (8, 5), (0, 0), (3, 0), (10, 2), (10, None), (40, 2), (40, None)]
    assert [any_folder.read("a", *part) for part in parts] == [
        b"0123456789", b"3456789", b"3456", b"89", b"", b"", b"", b"", b"", b""]
    assert [any_folder.read("empty", *part) for part in [(0, None), (0, 3), (1, None)]] == [b"", b"", b""]
    for part in [(0, None), (0, 0), (5, 2), (5, None)]:
        with pytest.raises(FileNotFoundError, match=any_folder.url):
            any_folder.read("none", *part)


def test_more_objects_than_one_request_lists_or_deletes(in_s3: ObjectFolder, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gearchaos.store.files.object_folder._PAGE", 7)
    names = [f"many/{i:03}" for i in range(30)]
    for name in names:
        in_s3.write(name, b"1")
    assert sorted(name for name, _ in in_s3.list("many")) == names
    in_s3.delete_tree("many")
    assert list(in_s3.list()) == []


def test_a_file_is_created_once(any_folder: Folder) -> None:
    assert any_folder.create("a", b"same") and not any_folder.create("a", b"same")
    assert not any_folder.create("a", b"other") and any_folder.read("a") == b"same"


def test_a_creation_of_which_the_answer_was_lost_has_succeeded(
    folder: ObjectFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    put = ObjectFolder._put

    def repeated(self, *arguments, **options):
        """As a client does that gets no answer to its first request."""
        put(self, *arguments, **options)
        return put(self, *arguments, **options)

    monkeypatch.setattr(ObjectFolder, "_put", repeated)
    assert folder.create("a", b"1")
    assert not folder.create("a", b"1")


def test_appending_continues_what_exists(any_folder: Folder) -> None:
    assert [any_folder.append("a", part) for part in (b"one", memoryview(b"two"))] == [0, 3]
    again = open_folder(any_folder.url)
    assert again.append("a", b"three") == 6 and any_folder.read("a") == b"onetwothree"
    again.delete("a")
    assert again.append("a", b"new") == 0
    again.write("a", b"replaced")
    assert again.append("a", b"!") == 8 and any_folder.read("a") == b"replaced!"


def test_a_second_writer_of_an_appended_file_is_noticed(folder: ObjectFolder) -> None:
    folder.append("a", b"one")
    other = ObjectFolder(folder.url)
    other.append("a", b"two")
    with pytest.raises(OSError, match="a: another process writes to it"):
        folder.append("a", b"three")
    assert folder.read("a") == b"onetwo"
    assert folder.append("a", b"four") == 6  # it has read what the other one wrote


def test_an_append_of_which_the_answer_was_lost_has_succeeded(
    folder: ObjectFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    put = ObjectFolder._put

    def repeated(self, *arguments, **options):
        put(self, *arguments, **options)
        return put(self, *arguments, **options)

    folder.append("a", b"one")
    monkeypatch.setattr(ObjectFolder, "_put", repeated)
    assert [folder.append("a", b"two"), folder.append("b", b"x"), folder.append("a", b"!")] == [3, 0, 6]
    assert folder.read("a") == b"onetwo!"


def test_content_of_only_some_appended_files_is_kept_in_memory(folder: ObjectFolder) -> None:
    for repetition in range(2):
        for number in range(20):
            assert folder.append(f"{number}", b"ab") == 2 * repetition
    assert len(folder._appended) <= 8


def test_an_equal_folder_comes_from_its_pickle_without_credentials(in_s3: ObjectFolder) -> None:
    in_s3.append("a", b"content")
    pickled = pickle.dumps(in_s3)
    assert b"secret" not in pickled and b"content" not in pickled
    again = pickle.loads(pickled)
    assert again == in_s3 and hash(again) == hash(in_s3) and str(again) == in_s3.url
    assert again != ObjectFolder(f"{in_s3.url}/other") and again.read("a") == b"content"


@pytest.mark.parametrize("url", ["s3://bucket//a///b/", "S3://bucket/a/b"])
def test_urls_are_normalised(url: str) -> None:
    assert ObjectFolder(url).url == "s3://bucket/a/b"


@pytest.mark.parametrize("url", ["http://bucket/a", "s3://", "s3:///", "s3://b/a?x=1", "s3://b/a/../c", "s3://b/a#c",
                                 "s3://b/a%20c", "s3:/b/c", "s3://b c/d", "ftp://b"])
def test_other_urls_are_refused(url: str) -> None:
    with pytest.raises(InputError, match=r"^store must") as caught:
        ObjectFolder(url)
    assert caught.value.value == url


def test_names_that_leave_the_folder_are_refused(folder: ObjectFolder) -> None:
    with pytest.raises(OSError, match=r"\.\./a"):
        folder.read("../a")


def test_zarr_and_xarray_read_and_write_through_it(in_s3: ObjectFolder) -> None:
    written = xr.Dataset({"v": (("y", "x"), np.arange(12.0).reshape(3, 4))})
    written.to_zarr(in_s3.zarr_store(read_only=False), zarr_format=3, consolidated=False)
    with xr.open_zarr(in_s3.zarr_store(), consolidated=False) as read:
        xr.testing.assert_identical(read.load(), written)
    with pytest.raises(ValueError, match="read-only"):
        zarr.open_array(in_s3.zarr_store(), path="v", mode="r+")[0] = 1


# --- drafts


@pytest.fixture
def draft(folder: ObjectFolder) -> Iterator[Path]:
    with folder.draft() as path:
        for name in ("zarr.json", "v/zarr.json", "run/study.json", "run/sums.json"):
            (path / name).parent.mkdir(parents=True, exist_ok=True)
            (path / name).write_text(name)
        yield path


def test_a_draft_is_published_once(folder: ObjectFolder, draft: Path) -> None:
    folder.check_creatable()
    assert not folder.exists() and folder.publish(draft) and folder.exists()
    names = {name for name, _ in folder.list()} - {"run/creation.lock"}
    assert names == {"zarr.json", "v/zarr.json", "run/study.json", "run/sums.json"}
    assert folder.read("v/zarr.json") == b"v/zarr.json"
    (draft / "zarr.json").write_text("changed")
    assert not folder.publish(draft) and folder.read("zarr.json") == b"zarr.json"


def test_a_draft_that_another_process_published_meanwhile_is_kept(
    folder: ObjectFolder, draft: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert folder.publish(draft)
    (draft / "zarr.json").write_text("changed")
    monkeypatch.setattr(ObjectFolder, "exists", lambda _: False)  # as before the other process was done
    assert not folder.publish(draft) and folder.read("zarr.json") == b"zarr.json"


def test_the_description_is_uploaded_last(folder: ObjectFolder, draft: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    order, put = [], ObjectFolder._put

    def recorded(self, name, *arguments, **options):
        order.append(name)
        return put(self, name, *arguments, **options)

    monkeypatch.setattr(ObjectFolder, "_put", recorded)
    folder.publish(draft)
    assert len(order) == 4 and order[-1] == "run/study.json"


def test_a_draft_that_was_not_published_completely_is_published_again(
    folder: ObjectFolder, draft: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _fail_at_the_end(folder, draft, monkeypatch)
    assert folder.size("zarr.json") and not folder.exists()
    assert folder.publish(draft) and folder.exists()


def test_rests_of_another_draft_are_not_mixed_with_a_new_one(
    folder: ObjectFolder, draft: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _fail_at_the_end(folder, draft, monkeypatch)
    (draft / "v" / "zarr.json").rename(draft / "w.json")
    with pytest.raises(InputError, match=r"It has v/zarr\.json, left by"):
        folder.publish(draft)
    assert not folder.exists() and folder.size("w.json") is None


def _fail_at_the_end(folder: ObjectFolder, draft: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Upload a draft but for its description."""
    with monkeypatch.context() as patched:
        patched.setattr(ObjectFolder, "create", lambda *_: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            folder.publish(draft)


def test_a_draft_is_not_published_among_other_files(folder: ObjectFolder, draft: Path) -> None:
    folder.write("thesis.pdf", b"1")
    assert folder.exists() and not folder.publish(draft)
    assert list(folder.list()) == [("thesis.pdf", 1)]


# --- locks


def test_a_lock_is_held_by_one_at_a_time(folder: ObjectFolder) -> None:
    with folder.lock("lock", 0):
        with pytest.raises(Timeout, match=f"lock is held by {platform.node()}:{os.getpid()}, until .* UTC") as caught:
            folder.lock("lock", 0).__enter__()
        assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)
        with folder.lock("other", 0):
            pass
    with folder.lock("lock", 0):
        pass


def test_a_lock_is_given_back_after_an_error(folder: ObjectFolder) -> None:
    with pytest.raises(ZeroDivisionError), folder.lock("lock", 0):
        raise ZeroDivisionError
    with folder.lock("lock", 0):
        pass


@pytest.mark.parametrize("ends, free", [(-1.0, True), (60.0, False)])
def test_a_lock_of_another_machine_is_free_when_it_expires(folder: ObjectFolder, ends: float, free: bool) -> None:
    _write_lease(folder, time.time() + ends)
    if free:
        with folder.lock("lock", 0):
            assert json.loads(folder.read("lock"))["machine"] == f"{platform.node()}:{os.getpid()}"
    else:
        with pytest.raises(Timeout, match="held by elsewhere:7"), folder.lock("lock", 0.1):
            pass


def test_waiting_for_a_lock_ends_when_it_expires(folder: ObjectFolder) -> None:
    _write_lease(folder, time.time() + 1)
    with folder.lock("lock", -1):
        pass


@pytest.mark.parametrize("content", [b"", b"{}", b"\xff", b"[1]", b'{"token": 1}'])
def test_an_object_that_is_no_lease_is_replaced(folder: ObjectFolder, content: bytes) -> None:
    folder.write("lock", content)
    with folder.lock("lock", 0):
        pass


def _write_lease(folder: ObjectFolder, expires: float, machine: str = "elsewhere:7") -> None:
    """Write the lease of a process of another machine."""
    content = {"token": "t", "machine": machine, "process": "boot pid:[1] 7 8", "expires": expires, "renewals": 0}
    folder.write("lock", json.dumps(content).encode())


def test_a_lock_is_renewed(folder: ObjectFolder, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lease, "RENEWAL", 0.05)
    with folder.lock("lock", 0):
        before = json.loads(folder.read("lock"))
        _until(lambda: json.loads(folder.read("lock"))["renewals"] >= 3)
        after = json.loads(folder.read("lock"))
        assert after["expires"] > before["expires"] and after["token"] == before["token"]


def test_a_lock_that_another_process_took_is_reported_and_left_to_it(
    folder: ObjectFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lease, "RENEWAL", 0.05)
    renewals = _renewals()
    with pytest.raises(OSError, match="lock was lost to another process"), folder.lock("lock", 0):
        _write_lease(folder, time.time() + 60)
        _until(lambda: not _renewals() - renewals)  # its thread ends
    assert json.loads(folder.read("lock"))["machine"] == "elsewhere:7"


def test_a_renewal_of_which_the_answer_was_lost_keeps_the_lock(
    folder: ObjectFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lease, "RENEWAL", 0.05)
    put = lease._put

    def repeated(*arguments):
        put(*arguments)
        return put(*arguments)

    monkeypatch.setattr(lease, "_put", repeated)
    with folder.lock("lock", 0):
        _until(lambda: json.loads(folder.read("lock"))["renewals"] >= 3)


def test_a_lock_survives_an_outage(folder: ObjectFolder, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lease, "RENEWAL", 0.02)
    put, failed = lease._put, []

    def failing(*arguments):
        if len(failed) < 5:
            failed.append(1)
            raise object_client.obstore().exceptions.GenericError("outage")
        return put(*arguments)

    with folder.lock("lock", 0):
        monkeypatch.setattr(lease, "_put", failing)
        _until(lambda: json.loads(folder.read("lock"))["renewals"] >= 2)
    assert len(failed) == 5


def _renewals() -> set[int | None]:
    """The threads that renew leases."""
    import threading

    return {thread.ident for thread in threading.enumerate() if thread.name.startswith("renew ")}


def _until(condition) -> None:
    """Wait until a condition holds; fails after a minute."""
    end = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


# --- processes that race


def create_all(url: str, count: int) -> list[bool]:
    folder = ObjectFolder(url)
    return [folder.create(f"{number}", f"{os.getpid()}".encode()) for number in range(count)]


def increase(url: str, count: int) -> int:
    """Add 1 to a number in a file, in two steps that only the lock keeps together."""
    folder = ObjectFolder(url)
    for _ in range(count):
        with folder.lock("lock", 60):
            number = int(folder.read("number"))
            time.sleep(0.02)
            folder.write("number", f"{number + 1}".encode())
    return os.getpid()


def test_of_two_processes_one_creates_a_file_and_one_holds_a_lock(in_s3: ObjectFolder) -> None:
    in_s3.write("number", b"0")
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as processes:
        created = [processes.submit(create_all, in_s3.url, 60) for _ in range(2)]
        assert all(a != b for a, b in zip(*(future.result() for future in created), strict=True))
        for future in [processes.submit(increase, in_s3.url, 4) for _ in range(2)]:
            future.result()
    assert in_s3.read("number") == b"8"


HOLDER = """
import sys, time
from gearchaos.store.files.folder import Folder, open_folder
from gearchaos.store.files.object_folder import ObjectFolder
with ObjectFolder(sys.argv[1]).lock("lock", 0):
    print("held", flush=True)
    time.sleep(60)
"""


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="processes are recognised by /proc")
@pytest.mark.parametrize("reaped", [True, False])
def test_the_lock_of_a_killed_process_of_this_machine_is_free_at_once(in_s3: ObjectFolder, reaped: bool) -> None:
    process = subprocess.Popen([sys.executable, "-c", HOLDER, in_s3.url], stdout=subprocess.PIPE)
    try:
        assert process.stdout.readline() == b"held\n"
        with pytest.raises(Timeout, match=f"held by {platform.node()}:{process.pid}"), in_s3.lock("lock", 0):
            pass
        process.send_signal(signal.SIGKILL)
        if reaped:
            process.wait()
        with in_s3.lock("lock", 10):
            pass
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


# --- errors


def test_a_missing_bucket_is_reported(in_s3: ObjectFolder) -> None:
    url = "s3://no-such-bucket/map.zarr"
    with pytest.raises(InputError, match="There is no such bucket: create it") as caught:
        ObjectFolder(url).check_creatable()
    assert caught.value.field == "store" and caught.value.value == url


def test_missing_credentials_are_reported(in_s3: ObjectFolder, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("AWS_ACCESS_KEY_ID")
    monkeypatch.delenv("AWS_SECRET_ACCESS_KEY")
    with pytest.raises(InputError, match=r"Credentials are missing or refused .* Set AWS_ACCESS_KEY_ID") as caught:
        in_s3.exists()
    assert in_s3.url in str(caught.value) and "\n" not in str(caught.value)


def test_a_server_that_cannot_be_reached_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    use(environment(1), monkeypatch)
    with pytest.raises(InputError, match="Check the network") as caught:
        ObjectFolder("s3://bucket/map.zarr").size("a")
    assert "\n" not in str(caught.value)


def test_a_server_that_does_not_answer_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    from datetime import timedelta

    monkeypatch.setattr(object_client, "_FIRST_TIMEOUT", timedelta(seconds=0.3))
    with socket.create_server(("127.0.0.1", 0)) as silent:
        use(environment(silent.getsockname()[1]), monkeypatch)
        with pytest.raises(InputError, match="Check the network"):
            ObjectFolder("s3://bucket/map.zarr").size("a")


def test_an_endpoint_that_is_no_url_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    use({**environment(1), "AWS_ENDPOINT_URL": "localhost"}, monkeypatch)
    with pytest.raises(InputError, match=r"^AWS_ENDPOINT_URL must begin with http://"):
        ObjectFolder("s3://bucket/map.zarr").size("a")


def test_a_missing_package_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "obstore", None)
    with pytest.raises(InputError, match=r'pip install "gearchaos\[object\]"'):
        ObjectFolder("memory://missing").size("a")


def test_a_server_that_ends_is_an_error_of_the_system(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(object_client, "_LATER", {"max_retries": 0})
    with s3_server(tmp_path) as variables:
        use(variables, monkeypatch)
        folder = ObjectFolder(f"s3://{BUCKET}/map.zarr")
        folder.write("a", b"1")
    for call in (lambda: folder.read("a"), lambda: folder.write("a", b"2"), lambda: folder.create("b", b"2"),
                 lambda: folder.append("a", b"2"), lambda: folder.size("a"), lambda: list(folder.list()),
                 lambda: folder.delete("a"), lambda: folder.lock("lock", 0).__enter__()):
        with pytest.raises(ConnectionError, match="The object store failed") as caught:
            call()
        assert "s3://bucket/map.zarr" in str(caught.value) and "\n" not in str(caught.value)
