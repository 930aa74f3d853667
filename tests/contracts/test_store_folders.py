"""Files of stores on a file system: whole or not at all, on the disk when a method returns, and never waited for."""

import errno
import os
import resource
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import filelock
import pytest

import gearchaos as gc
from gearchaos.store.files.folder import LocalFolder, open_folder


@pytest.fixture
def folder(tmp_path):
    return LocalFolder(tmp_path / "s.zarr")


def test_a_folder_is_opened_again_by_its_url(folder, monkeypatch, tmp_path):
    assert open_folder(folder.url) == folder and str(folder) == str(tmp_path / "s.zarr")
    monkeypatch.chdir(tmp_path)
    near = open_folder("s.zarr")
    assert (str(near), near.url) == ("s.zarr", folder.url) and not near.exists()


def test_files_are_written_read_listed_and_deleted(folder):
    folder.write("a/b.txt", b"0123456789")
    folder.write("c", b"")
    assert folder.read("a/b.txt") == b"0123456789" and folder.read("a/b.txt", 3, 4) == b"3456"
    assert folder.read("a/b.txt", 8, 100) == b"89" and folder.read("a/b.txt", 20) == b""
    assert (folder.size("a/b.txt"), folder.size("c"), folder.size("a"), folder.size("a/b.txt/d")) == (10, 0, None, None)
    assert dict(folder.list()) == {"a/b.txt": 10, "c": 0} and dict(folder.list("a")) == {"a/b.txt": 10}
    assert list(folder.list("none")) == []
    folder.delete("c")
    folder.delete("c")
    folder.delete_tree("a")
    folder.delete_tree("a")
    assert list(folder.list()) == []
    with pytest.raises(FileNotFoundError):
        folder.read("c")


def test_of_many_that_create_a_file_one_succeeds(folder):
    with ThreadPoolExecutor(8) as pool:
        made = list(pool.map(lambda n: folder.create("x", b"%d" % n), range(32)))
    assert sum(made) == 1 and folder.read("x") == b"%d" % made.index(True)
    assert [name for name, _ in folder.list()] == ["x"]


def test_appending_gives_the_offset(folder):
    assert [folder.append("s/x", part) for part in (b"ab", memoryview(b"cde"), b"")] == [0, 2, 5]
    assert folder.read("s/x") == b"abcde"


@contextmanager
def disk_of(size):
    """Within it no file can be longer than ``size``."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_on_a_full_disk_nothing_is_appended(folder):
    folder.append("x", b"0" * 90)
    with disk_of(100), pytest.raises(OSError, match=r"File too large: '.*/s\.zarr/x'"):
        folder.append("x", b"1" * 20)
    assert folder.read("x") == b"0" * 90 and folder.append("x", b"2") == 90


def test_on_a_full_disk_the_older_file_is_kept(folder):
    folder.write("x", b"old")
    with disk_of(100), pytest.raises(OSError, match="File too large"):
        folder.write("x", b"1" * 200)
    assert dict(folder.list()) == {"x": 3}


@pytest.mark.parametrize("make", [os.mkfifo, os.mkdir])
def test_what_is_no_file_is_refused_without_waiting(make, folder, no_waiting):
    folder.write("a/x", b"")
    make(folder.path / "a" / "y")
    assert folder.size("a/y") is None and dict(folder.list()) == {"a/x": 0}
    for action in (folder.read, lambda name: folder.append(name, b"1")):
        with pytest.raises(OSError) as error:
            action("a/y")
        assert error.value.errno in (errno.EINVAL, errno.EISDIR)
    with pytest.raises(gc.InputError, match=r"store must have a file at this path; got '.*a/y'"):
        folder.write("a/y", b"1")
    with pytest.raises(gc.InputError, match=r"store must have a folder at this path; got '.*a/x'"):
        folder.write("a/x/z", b"1")


def test_a_lock_excludes_others_and_ends_with_its_process(folder):
    code = ("import sys, time; from gearchaos.store.files.folder import open_folder\n"
            f"with open_folder({folder.url!r}).lock('run/l', 5): print('held', flush=True); time.sleep(60)")
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE) as process:
        assert process.stdout.readline() == b"held\n"
        with pytest.raises(filelock.Timeout), folder.lock("run/l", 0):
            pass
        process.send_signal(signal.SIGKILL)
    with folder.lock("run/l", 5):
        pass


def test_a_draft_is_published_once(folder):
    for content, published in ((b"1", True), (b"2", False)):
        with folder.draft() as path:
            LocalFolder(path).write("run/x", content)
            assert folder.publish(path) == published
    assert folder.read("run/x") == b"1" and os.listdir(folder.path.parent) == ["s.zarr"]


def test_a_folder_needs_a_parent_and_no_broken_link(tmp_path):
    with pytest.raises(gc.InputError, match="out must lie in an existing folder"):
        LocalFolder(tmp_path / "a" / "b").check_creatable()
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    with pytest.raises(gc.InputError, match="out must not be a link to nothing"):
        LocalFolder(tmp_path / "link").exists()


class Disk:
    """Emulates a disk that loses, at a power failure, what was not synchronised."""

    def __init__(self, monkeypatch):
        self.files, self.folders = set(), {}
        true = os.fsync
        monkeypatch.setattr(os, "fsync", lambda descriptor: (self.note(descriptor), true(descriptor))[1])

    def note(self, descriptor):
        path = os.path.realpath(f"/proc/self/fd/{descriptor}")
        if os.path.isdir(path):
            self.folders[path] = {name: os.stat(os.path.join(path, name)).st_ino for name in os.listdir(path)}
        else:
            status = os.fstat(descriptor)
            self.files.add((status.st_ino, status.st_size))

    def survives(self, path):
        """Whether the file, with its present size, and all folders above it up to that of the test are on the disk."""
        status, path = os.stat(path), os.path.realpath(path)
        return (status.st_ino, status.st_size) in self.files and self.named(path)

    def named(self, path):
        parent, name = os.path.split(path)
        entry = self.folders.get(parent, {}).get(name) == os.stat(path).st_ino
        return entry and (parent == self.root or self.named(parent))


@pytest.mark.parametrize("action", [
    lambda folder: folder.write("run/deep/x", b"content"), lambda folder: folder.create("run/deep/x", b"content"),
    lambda folder: folder.append("run/deep/x", b"content"),
    lambda folder: (folder.append("run/deep/x", b"con"), folder.append("run/deep/x", b"tent")),
    lambda folder: (folder.write("run/deep/x", b"old"), folder.write("run/deep/x", b"content")),
], ids=["write", "create", "append", "append twice", "replace"])
def test_what_is_written_survives_a_power_failure(action, folder, monkeypatch):
    disk = Disk(monkeypatch)
    disk.root = os.path.realpath(folder.path.parent)
    action(folder)
    assert folder.read("run/deep/x") == b"content" and disk.survives(folder.path / "run" / "deep" / "x")


def test_a_published_store_survives_a_power_failure(folder, monkeypatch):
    disk = Disk(monkeypatch)
    disk.root = os.path.realpath(folder.path.parent)
    with folder.draft() as path:
        (path / "a").mkdir(parents=True)
        (path / "a" / "x").write_bytes(b"1")
        folder.publish(path)
    assert disk.named(str(folder.path)) and (os.stat(folder.path / "a" / "x").st_ino, 1) in disk.files
