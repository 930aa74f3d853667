"""A random sample of the mutants of some modules."""

from __future__ import annotations

import ast
import random
from collections.abc import Iterator
from dataclasses import dataclass
from difflib import unified_diff
from hashlib import sha256
from pathlib import Path

from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.operators.operator import Operator

from tests.mutation.operators import FAMILIES

_UNPACKING = ("parameters", "dictorsetmaker", "atom", "trailer", "arglist", "testlist_star_expr", "lambdef")
"""Parent nodes in which * or ** unpacks arguments and is not arithmetic."""

Change = tuple[type[Operator], int]
"""A mutation operator and the number of the occurrence that it changes."""


@dataclass(frozen=True)
class Mutant:
    """A source file with one change: path, line, name of the mutation operator, diff, and the changed source."""

    path: Path
    line: int
    kind: str
    change: str
    source: str

    @property
    def key(self) -> str:
        """A digest of the file name and the changed source."""
        return sha256(f"{self.path.name} {self.source}".encode()).hexdigest()[:16]


def sample(files: list[Path], count: int, seed: int) -> list[Mutant]:
    """Mutants of these files at ``count`` random places, distributed over the files in proportion to their places."""
    rng = random.Random(seed)
    places = {path: _places(path.read_text()) for path in files}
    shares = _shares({path: len(found) for path, found in places.items()}, count, rng)
    return [mutant for path in files for mutant in _some(path, places[path], shares[path], rng)]


def _shares(sizes: dict[Path, int], count: int, rng: random.Random) -> dict[Path, int]:
    """How many of ``count`` mutants each file gets: proportional to its size, rounded at random."""
    each, at, out = count / sum(sizes.values()), rng.random(), {}
    for path, size in sizes.items():
        out[path], at = int(at + each * size) - int(at), at + each * size
    return out


def _places(source: str) -> list[list[Change]]:
    """The possible changes at every place of a source."""
    found: dict[tuple[str, tuple[int, int]], list[Change]] = {}
    nodes = list(ast_nodes(get_ast(source)))
    for family, operators in FAMILIES.items():
        for operator in operators:
            acting = [(node, at[0]) for node in nodes for at in operator().mutation_positions(node)]
            for occurrence, (node, begin) in enumerate(acting):
                if node.type != "operator" or node.parent.type not in _UNPACKING:
                    found.setdefault((family, begin), []).append((operator, occurrence))
    return list(found.values())


def _some(path: Path, places: list[list[Change]], count: int, rng: random.Random) -> Iterator[Mutant]:
    """One mutant at each of ``count`` random places, or at fewer if fewer places give a mutant."""
    source = path.read_text()
    for place in rng.sample(places, len(places)):
        if count == 0:
            return
        operator, occurrence = rng.choice(place)
        changed = mutate_code(source, operator(), occurrence)
        if changed and _behaviour(changed) not in (None, _behaviour(source)):
            count -= 1
            yield _mutant(path, operator.__name__, source, changed)


def _mutant(path: Path, kind: str, source: str, changed: str) -> Mutant:
    lines = list(unified_diff(source.splitlines(), changed.splitlines(), n=0, lineterm=""))[2:]
    blank = next(i for i, changed in enumerate(lines[1:]) if changed.strip("- "))
    line = int(lines[0].split()[1].lstrip("-").split(",")[0]) + blank
    return Mutant(path, line, kind, "\n".join(lines[1:]), changed)


def _behaviour(source: str) -> str | None:
    """The syntax tree without what does not change behaviour; None if the source does not compile."""
    try:
        compile(source, "mutant", "exec", dont_inherit=True)
        return ast.dump(_Behaviour().visit(ast.parse(source)))
    except SyntaxError:
        return None


class _Behaviour(ast.NodeTransformer):
    """Removes annotations, docstrings, arguments of errors and ``frozen`` of dataclasses."""

    def visit_arg(self, node: ast.arg) -> ast.AST:
        node.annotation = None
        return node

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        node.returns = None
        return self.generic_visit(node)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.AST:
        node.annotation = ast.Constant(None)
        return self.generic_visit(node)

    def visit_Expr(self, node: ast.Expr) -> ast.AST:
        return ast.Pass() if isinstance(node.value, ast.Constant) else self.generic_visit(node)

    def visit_ClassDef(self, node: ast.ClassDef) -> ast.AST:
        for call in (d for d in node.decorator_list if isinstance(d, ast.Call)):
            call.keywords = [k for k in call.keywords if k.arg != "frozen"]
        return self.generic_visit(node)

    def visit_Raise(self, node: ast.Raise) -> ast.AST:
        if isinstance(node.exc, ast.Call):
            node.exc.args, node.exc.keywords = [], []
        return node
