"""What a disk holds after a power failure, from what a process did to files.

A file system promises only what POSIX says: the content of a file is durable as of its last `fsync`, the entries of a
folder (files made, renamed, linked and deleted in it) as of the last `fsync` of the folder. What was done since may be
on the disk or not, each change independently of the others.
"""

from __future__ import annotations

import os
import pickle
import random
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from threading import RLock

Event = tuple[str, str, str | bytes]
"""What was done to the file or folder with a path, and another path or the content."""


@contextmanager
def recorded(path: str | None) -> Iterator[None]:
    """Write what this process does to the files below its working folder to a file, as a list of `Event`."""
    if path is None:
        yield
        return
    root, events, lock = os.getcwd(), list[Event](), RLock()

    def note(kind: str, path: str, other: str | bytes = b"") -> None:
        if f"{path}/".startswith(f"{root}/"):
            events.append((kind, path[len(root) + 1:], other[len(root) + 1:] if isinstance(other, str) else other))

    def content(path: str) -> None:
        if os.path.isfile(path):
            note("content", path, Path(path).read_bytes())

    def absolute(path, folder=None) -> str:
        return os.path.join(root if folder is None else os.readlink(f"/proc/self/fd/{folder}"), os.fspath(path))

    def moving(kind, true):
        def move(old, new, **options):
            with lock:
                content(absolute(old))
                true(old, new, **options)
                note(kind, absolute(old), absolute(new))
        return move

    def changing(kind, true):
        def change(path, *arguments, dir_fd=None, **options):
            with lock:
                where = absolute(path, dir_fd)
                true(path, *arguments, dir_fd=dir_fd, **options)
                note(kind, where)
        return change

    def fsync(file):
        with lock:
            where = os.readlink(f"/proc/self/fd/{file}")
            content(where)
            note("fsync", where)

    def write(file, data):
        with lock:
            count = true_write(file, data)
            content(os.readlink(f"/proc/self/fd/{file}"))
        return count

    true_write = os.write
    for name in ("rename", "replace", "link"):
        setattr(os, name, moving("link" if name == "link" else "rename", getattr(os, name)))
    for name, kind in (("unlink", "delete"), ("remove", "delete"), ("rmdir", "delete"), ("mkdir", "folder")):
        setattr(os, name, changing(kind, getattr(os, name)))
    os.fsync, os.write = fsync, write
    try:
        yield
    finally:
        Path(path).write_bytes(pickle.dumps(events))


@dataclass
class File:
    """A file: its content, and that which is durable."""

    content: bytes = b""
    durable: bytes | None = None


@dataclass
class Folder:
    """A folder: its entries by name, and those that are durable."""

    content: dict[str, File | Folder] = field(default_factory=dict)
    durable: dict[str, File | Folder] | None = None


class Disk:
    """A folder of files as events change it; what is in it at the beginning is durable."""

    def __init__(self, files: dict[str, bytes]) -> None:
        self.root = Folder()
        for name, content in files.items():
            parts = name.split("/")
            for end in range(1, len(parts)):
                self._folder(parts[:end]).content.setdefault(parts[end - 1], Folder())
            self._folder(parts).content[parts[-1]] = File(content)
        _make_durable(self.root)

    def _folder(self, parts: list[str]) -> Folder:
        found = self.root
        for name in parts[:-1]:
            found = found.content[name]
        return found

    def apply(self, events: list[Event]) -> Disk:
        for kind, path, other in events:
            parts = path.split("/")
            entries, name = self._folder(parts).content, parts[-1]
            match kind:
                case "folder":
                    entries[name] = Folder()
                case "content":
                    entries.setdefault(name, File()).content = other
                case "delete":
                    del entries[name]
                case "fsync":
                    node = entries[name] if path else self.root
                    node.durable = node.content if isinstance(node, File) else dict(node.content)
                case "link" | "rename":
                    target = other.split("/")
                    self._folder(target).content[target[-1]] = entries[name] if kind == "link" else entries.pop(name)
        return self

    def files(self, rng: random.Random, kept: float = 1.0, node: Folder | None = None) -> dict[str, bytes]:
        """Content by path of the files that a power failure leaves, where each change of folders that is not durable is
        kept with a probability; as processes see them with 1, what is durable alone with 0.

        The content of other files is lost, cut, or zeros.
        """
        node, out = node or self.root, dict[str, bytes]()
        durable = node.durable or {}
        for name in sorted(node.content.keys() | durable.keys()):
            found = (node.content if rng.random() < kept else durable).get(name)
            if isinstance(found, Folder):
                out |= {f"{name}/{inner}": content for inner, content in self.files(rng, kept, found).items()}
            elif found is not None:
                out[name] = found.content if kept == 1 else _survivor(found, rng, kept)
        return out


def _survivor(file: File, rng: random.Random, kept: float) -> bytes:
    if file.durable is not None or rng.random() < kept / 2:
        return file.content if file.durable is None else file.durable
    return rng.choice([b"", file.content[:rng.randint(0, len(file.content))], bytes(len(file.content))])


def _make_durable(folder: Folder) -> None:
    folder.durable = dict(folder.content)
    for node in folder.content.values():
        if isinstance(node, Folder):
            _make_durable(node)
        else:
            node.durable = node.content


def read_files(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def write_files(files: dict[str, bytes], folder: Path) -> None:
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
