"""Objects of stores, in a folder and in memory; URLs, and what is said where an object store cannot be reached."""

import errno
import os
import pickle
import shutil
import sys
from uuid import uuid4

import pytest

from gearchaos.errors import InputError
from gearchaos.store.objects import Objects


@pytest.fixture(params=["folder", "memory"])
def objects(request, tmp_path):
    return Objects(tmp_path / "map.zarr" if request.param == "folder" else f"memory://{uuid4().hex}/map.zarr")


def test_objects_are_written_read_listed_and_deleted(objects):
    assert not objects.exists() and objects.get("a") is None and objects.names() == []
    killed = f"b.{uuid4().hex}.partial"
    for name, content in (("a", b"first"), ("a", b"second"), ("run/tilesets", b"1"), (killed, b"half")):
        objects.put(name, content)
    objects.put("run/tiles/1", b"", durable=True)
    assert objects.exists() and (objects.get("a"), objects.get("a", 3), objects.get("a", 99)) == (
        b"second", b"sec", b"second")
    assert objects.get("run/tiles/1") == b"" and objects.get("run") is None is objects.get("a/b")
    assert sorted(objects.names()) == ["a", "run/tiles/1", "run/tilesets"] and objects.names("none") == []
    assert objects.names("run/tiles") == ["run/tiles/1"]
    objects.delete(objects.names(partial=True))  # what a killed process was writing
    assert objects.sizes(["a", "b", "run/tilesets"]) == {"a": 6, "run/tilesets": 1} and objects.total_bytes() == 7
    objects.keep(["a", "run/tiles/1"])
    objects.delete(["a", "a"])
    objects.delete_all("run/tiles")
    objects.delete_all("none")
    assert objects.names() == ["run/tilesets"]


def test_equal_objects_come_from_a_pickle_and_after_a_change_of_the_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    near = Objects("map.zarr")
    near.put("a", b"1")
    monkeypatch.chdir("/")
    for again in (pickle.loads(pickle.dumps(near)), Objects(near.url), near):
        assert (again.url, again.get("a")) == (str(tmp_path / "map.zarr"), b"1")
    assert str(near) == "map.zarr" and near.folder == tmp_path / "map.zarr"


def test_what_is_kept_survives_a_power_failure(tmp_path, monkeypatch):
    """The file, and all folders from the one in which the store is to the one in which the file is."""
    kept, true = [], os.fsync
    monkeypatch.setattr(os, "fsync", lambda d: (kept.append(os.path.realpath(f"/proc/self/fd/{d}")), true(d))[1])
    objects = Objects(tmp_path / "map.zarr")
    objects.put("run/deep/x", b"1")
    kept.clear()
    objects.keep(["run/deep/x"])
    path = tmp_path / "map.zarr/run/deep/x"
    assert kept[0] == str(path) and set(kept[1:]) == {str(p) for p in list(path.parents)[:4]}


def test_a_folder_needs_a_parent_and_no_broken_link(tmp_path):
    with pytest.raises(InputError, match="out must lie in an existing folder"):
        Objects(tmp_path / "a" / "b").check_creatable()
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    with pytest.raises(InputError, match="out must not be a link to nothing"):
        Objects(tmp_path / "link").exists()
    with pytest.raises(InputError, match="out must be a possible path of a folder"):
        Objects("a\0b").exists()
    with pytest.raises(InputError, match=r"For an object store: s3://bucket/y\.zarr"):
        Objects("s3:bucket/y.zarr").check_creatable()


@pytest.mark.parametrize("url", ["http://bucket/a", "s3://", "s3:///", "s3://b/a?x=1", "s3://b/a/../c", "s3://b/a#c",
                                 "s3://b/a%20c", "s3:/b/c", "s3://b c/d", "ftp://b"])
def test_urls_are_normalised_and_those_of_no_object_store_refused(url):
    for good in ("s3://bucket//a///b/", "S3://bucket/a/b"):
        assert (Objects(good).url, str(Objects(good)), Objects(good).folder) == ("s3://bucket/a/b", good, None)
    with pytest.raises(InputError, match=r"^store must") as caught:
        Objects(url)
    assert caught.value.value == url and ("pathlib.Path" in str(caught.value)) == (url == "s3:/b/c")


S3 = "Error performing LIST http://127.0.0.1:1/bucket in 1ms - Server returned "


@pytest.mark.parametrize("said", [S3 + "error: 404 Not Found: NoSuchBucket", "sending a request\n\nDebug source: x"])
def test_an_object_store_that_cannot_be_reached_is_told_with_advice(monkeypatch, said):
    obstore = pytest.importorskip("obstore")

    def refuse(*_, **__):
        raise obstore.exceptions.GenericError(said)

    monkeypatch.setattr(obstore, "list", refuse)
    words = r"in a bucket that can be reached; .*(NoSuchBucket|request)\. Check the bucket, .* variables AWS_…"
    with pytest.raises(InputError, match=words) as caught:
        Objects(f"s3://bucket/{uuid4().hex}").names()
    assert "\n" not in str(caught.value) and "Debug" not in str(caught.value)


def test_what_fails_later_is_an_error_of_the_system_with_the_object(monkeypatch):
    obstore, objects = pytest.importorskip("obstore"), Objects(f"memory://{uuid4().hex}")
    lost = obstore.exceptions.GenericError(S3 + "500 Internal\n\nDebug source: x")
    for error, words in ((lost, r"^[^\n]*The object store failed: Error performing [^\n]*/a'$"),
                         (OSError(errno.ENOSPC, "No space left on device"), "No space left on device: 'memory.*/a'")):
        async def fail(*_, error=error):
            raise error

        monkeypatch.setattr(objects.zarr, "get", fail)
        with pytest.raises(OSError, match=words):
            objects.get("a")


def test_a_missing_package_is_named_with_what_installs_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "obstore", None)
    with pytest.raises(InputError, match=r'pip install "gearchaos\[object\]"'):
        Objects(f"s3://bucket/{uuid4().hex}").get("a")


def test_what_another_process_deletes_at_the_same_time_is_deleted(tmp_path, monkeypatch):
    """It removes a file while this process goes through the folder, which then ends half-way."""
    objects, remove = Objects(tmp_path / "map.zarr"), shutil.rmtree
    for name in ("run/tiles/0/1", "run/tiles/0/2", "run/tiles/1/3"):
        objects.put(name, b"1")

    def interrupted(path):
        monkeypatch.setattr("shutil.rmtree", remove)
        remove(path / "0")
        raise FileNotFoundError(errno.ENOENT, "No such file or directory", str(path / "0"))

    monkeypatch.setattr("shutil.rmtree", interrupted)
    objects.delete_all("run/tiles")
    assert objects.names() == []
