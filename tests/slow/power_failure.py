"""What a disk holds after a power failure, from the system calls of a run as strace records them.

The model of a file system promises only what POSIX does. The content of a file is durable as of its last `fsync` or
`fdatasync`; the entries of a folder (files created, renamed, linked and deleted in it) as of the last `fsync` of the
folder. What was done since may be on the disk or not, each change independently of the others, as far as a `Loss` says.
"""

from __future__ import annotations

import os
import random
import re
from dataclasses import dataclass, field, replace
from itertools import count
from pathlib import Path

CALLS = (
    "openat,open,creat,write,pwrite64,writev,pwritev,pwritev2,rename,renameat,renameat2,link,linkat,unlink,unlinkat,mkdir,"
    "mkdirat,rmdir,fsync,fdatasync,sync,syncfs,sync_file_range,ftruncate,truncate,fallocate,sendfile,copy_file_range,"
    "symlink,symlinkat"
)
"""The system calls that change files or make changes durable."""

STRACE = ("strace", "-f", "--seccomp-bpf", "-y", "-xx", "-s", "100000000", "-e", f"trace={CALLS}", "-o")
"""Command that records the calls of another command; the file of the trace follows."""

_BEGUN = re.compile(r"(\d+) +(\w+)\((.*) <unfinished \.\.\.>$", re.S)
_RESUMED = re.compile(r"(\d+) +<\.\.\. (\w+) resumed>(.*)$", re.S)
_CALL = re.compile(r"(\d+) +(\w+)\((.*)\) += (-?\d+|\?)", re.S)
_ARGUMENT = re.compile(r'"((?:\\x[0-9a-f]{2})*)"|(-?\d+|AT_FDCWD)<((?:\\x[0-9a-f]{2})*)>(?:\(deleted\))?|([^,\s"]+)')


@dataclass
class File:
    """A file: its content, the content that is durable, and the number of the `fsync` that made it so."""

    content: bytes = b""
    durable: bytes = b""
    synchronised: int = 0


@dataclass
class Folder:
    """A folder: its entries by name, those that are durable, and the number of the `fsync` that made them so."""

    entries: dict[str, File | Folder] = field(default_factory=dict)
    durable: dict[str, File | Folder] = field(default_factory=dict)
    synchronised: int = 0


@dataclass(frozen=True)
class Loss:
    """What is lost of all that was not made durable.

    Attributes
    ----------
    entries : str
        "lost": folders are as they were when they were last synchronised; "kept": as the processes saw them; "any":
        each entry is one or the other.
    content : str
        "lost": files have their durable content; "zeros": their last size, with zeros in place of what was not
        durable; "torn": a part of what was written since; "any": each file one of these.
    """

    entries: str
    content: str


@dataclass(frozen=True)
class Call:
    """A system call that succeeded: its name, its arguments as text or bytes, and the number that it returned.

    A call of `fsync` appears twice: named "begin" when it begins, and by its name when it ends.
    """

    thread: str
    name: str
    arguments: tuple[bytes | str, ...]
    returned: int


_SYNC = ("fsync", "fdatasync")


def calls(trace: Path) -> list[Call]:
    """The successful calls of a trace in the order in which they began.

    Other threads may see the effect of a call before strace records its end.
    """
    found, begun = list[Call | None](), dict[str, tuple[int, str]]()
    for line in trace.read_text().splitlines():
        place = len(found)
        if unfinished := _BEGUN.match(line):
            thread, name, arguments = unfinished.groups()
            begun[thread] = place, f"{thread} {name}({arguments}"
            found.append(_call("begin", line) if name in _SYNC else None)
            continue
        if resumed := _RESUMED.match(line):
            place, beginning = begun.pop(resumed[1])
            line = beginning + resumed[3]
        ended = _CALL.match(line)
        if not ended or ended[4] == "?" or int(ended[4]) < 0:
            continue
        call = Call(ended[1], ended[2], tuple(map(_argument, _ARGUMENT.finditer(ended[3]))), int(ended[4]))
        if call.name not in _SYNC and place < len(found):
            found[place] = call
        else:
            found += [call] if place < len(found) or call.name not in _SYNC else [replace(call, name="begin"), call]
    return [call for call in found if call is not None]


def _call(name: str, line: str) -> Call:
    """A call that has begun, from a line of the trace."""
    begun = _BEGUN.match(line)
    return Call(begun[1], name, tuple(map(_argument, _ARGUMENT.finditer(begun[3]))), 0)


def _argument(found: re.Match[str]) -> bytes | str:
    """A path or content as bytes, the path of a descriptor, any other argument as text."""
    if found[1] is not None:
        return _bytes(found[1])
    return found[4] if found[3] is None else os.fsdecode(_bytes(found[3]))


def _bytes(escaped: str) -> bytes:
    return bytes.fromhex(escaped.replace("\\x", ""))


class Disk:
    """The files below a folder, as calls change them.

    Parameters
    ----------
    root : Path
        The folder.
    files : dict of str to bytes
        What is durable in it at the beginning: content by path of files, folders by a path that ends in "/".
    """

    def __init__(self, root: Path, files: dict[str, bytes]) -> None:
        self.root, self.tree = root, Folder()
        for path, content in files.items():
            *parents, name = path.rstrip("/").split("/")
            self._made(tuple(parents)).entries[name] = Folder() if path.endswith("/") else File(content, content)
        _make_durable(self.tree)
        self._begun: dict[str, tuple[int, bytes | dict[str, File | Folder]]] = {}
        self._numbers = count(1)

    def apply(self, call: Call) -> bool:
        """Apply a call; returns whether it concerns files below the root."""
        action = getattr(self, f"_{call.name}", None)
        if action is not None:
            return bool(action(call))
        inside = any(self._inside(a) for a in call.arguments)
        assert not inside, f"{call.name} is not modelled: {call.arguments}"
        return False

    def _inside(self, argument: bytes | str) -> bool:
        text = os.fsdecode(argument) if isinstance(argument, bytes) and len(argument) < 4096 else argument
        return isinstance(text, str) and (text == str(self.root) or text.startswith(f"{self.root}/"))

    def _parts(self, *arguments: bytes | str) -> tuple[str, ...] | None:
        """The names below the root of a path, given as a folder and a path in it; None if it is elsewhere."""
        path = os.path.normpath(os.path.join(*(os.fsdecode(a) for a in arguments)))
        if path == str(self.root):
            return ()
        inside = path.startswith(f"{self.root}/")
        return tuple(path[len(str(self.root)) + 1:].split("/")) if inside else None

    def _folder(self, parts: tuple[str, ...]) -> Folder | None:
        node: File | Folder | None = self.tree
        for name in parts:
            node = node.entries.get(name) if isinstance(node, Folder) else None
        return node if isinstance(node, Folder) else None

    def _node(self, *arguments: bytes | str) -> File | Folder | None:
        parts = self._parts(*arguments)
        if not parts:
            return None if parts is None else self.tree
        folder = self._folder(parts[:-1])
        return folder and folder.entries.get(parts[-1])

    def _change(self, node: File | Folder | None, *arguments: bytes | str) -> bool:
        """Let an entry be a node, or be no more."""
        parts = self._parts(*arguments)
        if parts:
            folder = self._made(parts[:-1])
            folder.entries.pop(parts[-1], None)
            if node is not None:
                folder.entries[parts[-1]] = node
        return parts is not None

    def _made(self, parts: tuple[str, ...]) -> Folder:
        """A folder; made if the call of another thread that makes it was recorded to begin later."""
        node = self.tree
        for name in parts:
            node = node.entries.setdefault(name, Folder())
        return node

    def _openat(self, call: Call) -> bool:
        at, path, flags = call.arguments[:3]
        node = self._node(at, path)
        if node is None and "O_CREAT" in flags:
            return self._change(File(), at, path)
        if isinstance(node, File) and "O_TRUNC" in flags:
            node.content = b""
        return False

    def _write(self, call: Call) -> bool:
        """All writes append: checked by comparing the result with the files that processes left."""
        node = self._node(call.arguments[0])
        if isinstance(node, File):
            node.content += call.arguments[1][:call.returned]
        return isinstance(node, File)

    def _pwrite64(self, call: Call) -> bool:
        node, at = self._node(call.arguments[0]), int(call.arguments[3])
        if isinstance(node, File):
            written = call.arguments[1][:call.returned]
            node.content = node.content[:at].ljust(at, b"\0") + written + node.content[at + len(written):]
        return isinstance(node, File)

    def _ftruncate(self, call: Call) -> bool:
        node, size = self._node(call.arguments[0]), int(call.arguments[1])
        if isinstance(node, File):
            node.content = node.content[:size].ljust(size, b"\0")
        return isinstance(node, File)

    def _begin(self, call: Call) -> bool:
        """Remember what a call of `fsync` finds: what is written after its beginning may not be durable at its end."""
        node = self._node(call.arguments[0])
        if node is not None:
            found = node.content if isinstance(node, File) else dict(node.entries)
            self._begun[call.thread] = next(self._numbers), found
        return node is not None

    def _fsync(self, call: Call) -> bool:
        node = self._node(call.arguments[0])
        if node is not None:
            number, found = self._begun.pop(call.thread)
            if number > node.synchronised:  # an fsync that began earlier may end later
                node.durable, node.synchronised = found, number
        return node is not None

    _fdatasync = _fsync

    def _rename(self, call: Call) -> bool:
        return self._move(("/", call.arguments[0]), ("/", call.arguments[1]))

    def _renameat(self, call: Call) -> bool:
        return self._move(call.arguments[:2], call.arguments[2:4])

    _renameat2 = _renameat

    def _move(self, old: tuple[bytes | str, ...], new: tuple[bytes | str, ...]) -> bool:
        node = self._node(*old)
        return bool(self._change(None, *old) | self._change(node, *new))

    def _link(self, call: Call) -> bool:
        return self._change(self._node(call.arguments[0]), call.arguments[1])

    def _linkat(self, call: Call) -> bool:
        return self._change(self._node(*call.arguments[:2]), *call.arguments[2:4])

    def _unlink(self, call: Call) -> bool:
        return self._change(None, call.arguments[0])

    _rmdir = _unlink

    def _unlinkat(self, call: Call) -> bool:
        return self._change(None, *call.arguments[:2])

    def _mkdir(self, call: Call) -> bool:
        return self._made(self._parts("/", call.arguments[0]) or ()) is not self.tree

    def _mkdirat(self, call: Call) -> bool:
        return self._made(self._parts(*call.arguments[:2]) or ()) is not self.tree


def _make_durable(folder: Folder) -> None:
    folder.durable = dict(folder.entries)
    for node in folder.entries.values():
        if isinstance(node, Folder):
            _make_durable(node)


def read_files(folder: Path) -> dict[str, bytes]:
    """Content by path of the files below a folder; folders by a path that ends in "/"."""
    paths = {path: str(path.relative_to(folder)) for path in sorted(folder.rglob("*"))}
    return {f"{name}/" if path.is_dir() else name: b"" if path.is_dir() else path.read_bytes()
            for path, name in paths.items()}


def survivors(tree: Folder, loss: Loss, rng: random.Random, at: str = "") -> dict[str, bytes]:
    """What remains after a power failure, in the form of `read_files`."""
    found = dict[str, bytes]()
    for name in sorted(tree.durable.keys() | tree.entries.keys()):
        kept = loss.entries == "kept" or (loss.entries == "any" and rng.random() < 0.5)
        node = (tree.entries if kept else tree.durable).get(name)
        if isinstance(node, Folder):
            found |= {f"{at}{name}/": b""} | survivors(node, loss, rng, f"{at}{name}/")
        elif node is not None:
            found[f"{at}{name}"] = _content(node, loss.content, rng)
    return found


def _content(file: File, loss: str, rng: random.Random) -> bytes:
    if loss == "any":
        loss = rng.choice(["lost", "zeros", "torn", "kept"])
    same = next((n for n, (a, b) in enumerate(zip(file.content, file.durable, strict=False)) if a != b),
                min(len(file.content), len(file.durable)))
    if loss == "zeros":
        return file.content[:same].ljust(len(file.content), b"\0")
    if loss == "torn":
        return file.content[:rng.randint(same, len(file.content))]
    return file.content if loss == "kept" else file.durable


def write_files(files: dict[str, bytes], folder: Path) -> None:
    """Make a folder with what `read_files` gives."""
    folder.mkdir()
    for name, content in files.items():
        path = folder / name
        if name.endswith("/"):
            path.mkdir(parents=True, exist_ok=True)
        else:
            path.write_bytes(content)
