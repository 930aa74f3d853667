"""Which modules a change reaches: those that import a changed one, directly or through others, by grimp."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

from tests import ROOT

_LAZY = re.compile(r"\b(?:gc|gearchaos)\.([A-Za-z_]\w*)")
"""A public name, whose module is imported on its first use, where grimp does not see it."""

_READ = {"docs/": "tests.pinned.test_docs", "README.md": "tests.pinned.test_docs", "examples/": "tests"}
"""Files that tests read: the modules that say where they are."""


def changed_files(since: str) -> list[str]:
    """What differs from a commit, with new files; where nothing differs, what that commit changed."""
    def lines(*arguments: str) -> list[str]:
        return subprocess.run(("git", *arguments), cwd=ROOT, capture_output=True, text=True).stdout.splitlines()

    found = lines("diff", "--name-only", since) + lines("ls-files", "--others", "--exclude-standard")
    return found or lines("diff", "--name-only", f"{since}~1", since)


def distances(files: Iterable[str]) -> dict[str, int]:
    """How many imports lead to a changed file from each test file that it reaches, by path; 0 for its own tests."""
    import grimp

    sys.path[:0] = [str(ROOT)]
    graph = grimp.build_graph("gearchaos", "tests", cache_dir=None)
    del sys.path[0]
    _add_lazy(graph)
    begin = {_module(file, graph.modules) for file in files} - {""}
    folders = tuple(module.removesuffix("conftest") for module in begin if module.endswith(".conftest"))
    begin |= {module for module in graph.modules if folders and module.startswith(folders)}  # pytest loads it for them
    found, front = dict.fromkeys(begin, 0), begin
    while front:
        front = {user for module in front for user in graph.find_modules_that_directly_import(module)} - found.keys()
        found |= dict.fromkeys(front, max(found.values()) + 1)
    return {f"{module.replace('.', '/')}.py": steps for module, steps in found.items() if ".test_" in module}


def _module(file: str, modules: Iterable[str]) -> str:
    """The module of a file, or the package whose data it is; none for what no test reads."""
    if reader := next((module for place, module in _READ.items() if file.startswith(place)), ""):
        return reader
    path = Path(file.removeprefix("src/"))
    names = (".".join(place.parts).removesuffix(".__init__") for place in (path.with_suffix(""), *path.parents))
    return next((name for name in names if name in modules), "")


def _add_lazy(graph: object) -> None:
    """The imports that ``gearchaos.__getattr__`` makes for those who use a public name."""
    from gearchaos import _MODULES

    for module in sorted(graph.modules):
        base = ROOT / ("src" if module.startswith("gearchaos") else "") / module.replace(".", "/")
        file = next(path for path in (base.with_suffix(".py"), base / "__init__.py") if path.is_file())
        for name in set(_LAZY.findall(file.read_text(encoding="utf-8"))) & _MODULES.keys():
            if module != (lazy := f"gearchaos.{_MODULES[name]}"):
                graph.add_import(importer=module, imported=lazy)
