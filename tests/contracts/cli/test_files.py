"""What is no file, and names that no file can have: refused before any work, never replaced and never waited for."""

import contextlib
import itertools
import os
import stat
import threading
import time

import pytest
import xarray as xr

import gearchaos as gc
from gearchaos.files import temporary_folder, write_bytes
from gearchaos.studyfile import load_study
from gearchaos.studyfile.loading import MAX_BYTES
from tests.commands import refused

SMALL = xr.Dataset({"z": ("tau", [1.0, 2.0])})
COMMANDS = {
    "simulate": ("simulate", "--periods", 1, "--out"),
    "zones": ("zones", "--axis", "omega=0.9:1.1:2", "--axis", "eps1=0:0.1:2", "--out"),
    "regime": ("regime", "--plot"), "plot": ("plot", "missing.nc", "--out"), "export": ("export", "missing", "--out")}


@pytest.fixture(params=["pipe", "link to a pipe"])
def pipe(request, tmp_path):
    """A pipe with a name, or a link to one, which must still be there afterwards."""
    os.mkfifo(tmp_path / "pipe")
    path = tmp_path / "pipe"
    if request.param != "pipe":
        path = tmp_path / "link"
        path.symlink_to(tmp_path / "pipe")
    yield path
    assert stat.S_ISFIFO(path.stat().st_mode)
    assert path.is_symlink() == (request.param != "pipe")


@pytest.fixture
def no_work(monkeypatch):
    def work(*_, **__):
        raise AssertionError("work has begun")

    for name in ("gearchaos.studyfile.load_study", "gearchaos.studies.load", "gearchaos.store.store.open_store",
                 "gearchaos.datasets.netcdf_bytes"):
        monkeypatch.setattr(name, work)


@pytest.mark.parametrize("name", COMMANDS)
def test_what_is_no_file_is_never_replaced(name, pipe, no_work):
    said = refused(*COMMANDS[name], pipe)
    assert f"{COMMANDS[name][-1]} must be a file; got '{pipe}'" in said and "not a regular file" in said


@pytest.mark.parametrize("name", COMMANDS)
def test_a_name_that_is_too_long_is_refused_before_any_work(name, tmp_path, no_work):
    said = refused(*COMMANDS[name], tmp_path / ("n" * 256))
    assert f"{COMMANDS[name][-1]} must be a path that can be written to" in said and "too long" in said


@pytest.mark.parametrize(("name", "rule"), [
    ("folder", "a file; got .*folder"), ("pipe", "a file; got .*not a regular file"),
    ("n" * 253 + ".nc", "a path that can be written to; got .*too long"),
    ("\0", "a path that can be written to; got .*null")])
def test_data_are_not_saved_over_what_is_no_file_nor_by_a_name_that_no_file_can_have(name, rule, tmp_path, no_work):
    (tmp_path / "folder").mkdir()
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(gc.InputError, match=f"path must be {rule}"):
        gc.save(SMALL, tmp_path / name)


def test_the_longest_name_can_be_written(tmp_path):
    path = tmp_path / ("n" * 252 + ".nc")
    gc.save(SMALL, path)
    write_bytes(path, b"again")
    assert path.read_bytes() == b"again" and list(tmp_path.iterdir()) == [path]


def test_what_is_no_file_is_not_read(pipe, no_waiting):
    with pytest.raises(gc.InputError, match=r"study file must be a readable file; got .* not a regular file"):
        load_study(pipe)
    with pytest.raises(gc.InputError, match=r"path must be a NetCDF file; got .* not a regular file"):
        gc.load(pipe)
    assert "not a regular file" in refused("plot", pipe, "--out", pipe.with_suffix(".png"))


def test_a_study_file_has_a_largest_size_and_may_begin_with_a_byte_order_mark(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text("[model]\nomega = 2.5\n", encoding="utf-8-sig")
    assert load_study(path).model.omega == 2.5
    path.write_bytes(b"[model]\nomega = 1.5 #".ljust(MAX_BYTES))
    assert load_study(path).model.omega == 1.5
    path.write_bytes(b"[model]\nomega = 1.5 #".ljust(MAX_BYTES + 1))
    with pytest.raises(gc.InputError, match=r"study file must be a readable file; got .*more than 1,000,000 bytes"):
        load_study(path)


def test_a_temporary_folder_goes_while_a_thread_still_writes_to_it(tmp_path):
    writing = threading.Event()

    def write(folder):
        until = time.monotonic() + 0.3
        for n in itertools.count():
            with contextlib.suppress(OSError):
                (folder / "inner").mkdir(exist_ok=True)
                (folder / "inner" / str(n)).write_text("x")
            writing.set()
            if time.monotonic() > until or not folder.exists():
                return

    with pytest.raises(ValueError, match=r"^the first error$"), temporary_folder(tmp_path) as folder:
        thread = threading.Thread(target=write, args=(folder,))
        thread.start()
        writing.wait()
        raise ValueError("the first error")
    thread.join()
    assert list(tmp_path.iterdir()) == []


def test_a_temporary_folder_is_hidden_beside_what_is_written(tmp_path):
    """In the same folder, so that a rename to the final name stays within one file system."""
    with temporary_folder(tmp_path) as folder:
        assert folder.is_dir() and folder.parent == tmp_path and folder.name.startswith(".")
    assert list(tmp_path.iterdir()) == []


def test_a_removal_that_fails_is_repeated_and_hides_no_error(tmp_path, monkeypatch):
    from gearchaos import files

    remove, attempts = files.shutil.rmtree, []

    def fails_twice(folder, ignore_errors=False):
        attempts.append(folder)
        if len(attempts) > 2:
            remove(folder)
        elif not ignore_errors:
            raise OSError("the folder is not empty")

    monkeypatch.setattr(files.shutil, "rmtree", fails_twice)
    with pytest.raises(ValueError, match=r"^the first error$"), temporary_folder(tmp_path):
        raise ValueError("the first error")
    assert len(attempts) == 3 and list(tmp_path.iterdir()) == []
