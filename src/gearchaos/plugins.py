"""What can be named: what gearchaos has, and what other installed packages offer by entry points.

What gearchaos has of a kind is a folder with a module for each; no list names it, since `declared` finds it.
A package offers a class or a value in a group of entry points, under the name that files, commands and pages use. A
`Register` reads its group once, and only when it is asked for a name that gearchaos has not, or for all names. What
cannot be used is left out with one warning that says whose it is; everything else works.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from importlib import import_module
from pkgutil import iter_modules
from threading import RLock
from typing import TYPE_CHECKING, Any, TypeVar

from gearchaos.errors import InputError, unknown_name

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

T = TypeVar("T")

_ORIGINS: dict[int, EntryPoint] = {}
"""The entry points of what other packages brought, by the identity of each value, which its register keeps."""


class NotInstalledError(InputError):
    """A name that neither gearchaos has nor an installed package."""


def modules(package: str) -> list[Any]:
    """The modules of a package."""
    return [import_module(f"{package}.{found.name}") for found in iter_modules(import_module(package).__path__)]


def declared(package: str, name: str) -> dict[str, Any]:
    """What the modules of a package call ``name``, in their order, by its own name; not every module must have it."""
    found = (getattr(module, name) for module in modules(package) if hasattr(module, name))
    return {each.name: each for each in found}


def versions_of(*values: Any) -> dict[str, str]:
    """The versions of the packages that brought these, as attributes of a Dataset; none for what is of gearchaos."""
    found = (_ORIGINS.get(id(value)) for value in values)
    return {f"{entry.dist.name}_version": entry.dist.version for entry in found if entry is not None and entry.dist}


def is_offered(group: str, name: str) -> bool:
    """Whether an installed package has an entry point of this name in a group; nothing is loaded."""
    from importlib.metadata import entry_points

    return bool(entry_points(group=group, name=name))


def class_of(base: type, attribute: str) -> Callable[[str, Any], str]:
    """The check of a `Register` of classes that derive from ``base``, and have their name in an attribute."""
    def fault(name: str, value: Any) -> str:
        if not (isinstance(value, type) and issubclass(value, base)):
            return f"it must be a class that derives from {base.__module__}.{base.__name__}"
        if missing := getattr(value, "__abstractmethods__", None):
            return f"it must define {', '.join(sorted(missing))}"
        return misnamed(name, getattr(value, attribute, None), attribute)
    return fault


def value_of(kind: type, attribute: str) -> Callable[[str, Any], str]:
    """The check of a `Register` of values of one class, which have their name in an attribute, if it is not empty."""
    def fault(name: str, value: Any) -> str:
        if not isinstance(value, kind):
            return f"it must be a {kind.__module__}.{kind.__name__}"
        return misnamed(name, getattr(value, attribute), attribute) if attribute else ""
    return fault


def misnamed(name: str, own: Any, attribute: str) -> str:
    """What is wrong with the name of an entry point, which must be that of what it loads; empty if nothing is."""
    return "" if own == name else f"its {attribute} must be the name of the entry point, not {own!r}"


class Register(Mapping[str, T]):
    """All of one kind by name: first those that gearchaos has, then those that other packages offer in a group.

    Parameters
    ----------
    group : str
        The group of entry points.
    own : mapping
        What gearchaos has.
    fault : callable
        Of a name and what a package offers by it: in words what is wrong with it; empty if nothing is.
    admit : callable, optional
        Called with each that is taken in.
    """

    def __init__(
        self, group: str, own: Mapping[str, T], fault: Callable[[str, Any], str],
        admit: Callable[[Any], None] = lambda value: None,
    ) -> None:
        self.group, self.own = group, own
        self._fault, self._admit, self._lock = fault, admit, RLock()
        self._guests: dict[str, T] = {}
        self._refused: dict[str, str] = {}  # why a name is not taken in

    @cached_property
    def offers(self) -> dict[str, EntryPoint]:
        """The entry points of the group by name, those whose names are free."""
        from importlib.metadata import entry_points

        found: dict[str, EntryPoint] = {}
        for entry in sorted(entry_points(group=self.group), key=_package):
            if entry.name in self.own or entry.name in found:
                owner = "gearchaos" if entry.name in self.own else _package(found[entry.name])
                self._left_out(entry, f"the name is taken by {owner}")
            else:
                found[entry.name] = entry
        return found

    def __getitem__(self, name: str) -> T:
        if name in self.own:
            return self.own[name]
        with self._lock:
            if name not in self._guests and name not in self._refused and name in self.offers:
                self._take_in(self.offers[name])
            return self._guests[name]

    def __iter__(self) -> Iterator[str]:
        yield from self.own
        yield from (name for name in self.offers if name in self)

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def take_in_all(self) -> None:
        """Load all that other packages offer, and nothing of gearchaos."""
        for name in self.offers:
            _ = name in self

    def loaded(self) -> list[T]:
        """Those of gearchaos, and of other packages those that were asked for already."""
        return [*self.own.values(), *self._guests.values()]

    def _take_in(self, entry: EntryPoint) -> None:
        """Load what an entry point names, or say why it is left out."""
        self._refused[entry.name] = "it is being imported"  # for what asks meanwhile
        try:
            value = entry.load()
            reason = self._fault(entry.name, value)
        except Exception as error:  # whatever the module of another package raises
            reason = f"it cannot be imported ({type(error).__name__}: {error})"
        if reason:
            self._refused[entry.name] = self._left_out(entry, reason)
            return
        del self._refused[entry.name]
        _ORIGINS[id(value)] = entry
        self._guests[entry.name] = value
        self._admit(value)

    def _left_out(self, entry: EntryPoint, reason: str) -> str:
        """Say that an entry point is left out; the message."""
        package = _package(entry)
        text = (f"{entry.name!r} of {package} is left out: {reason}. Entry point {entry.name} = {entry.value} in "
                f"{self.group}; update the package, or pip uninstall {package.partition(' ')[0]}.")
        warnings.warn(text, stacklevel=2)
        return text

    def unknown(self, field: str, name: object) -> NotInstalledError:
        """The error for a name that is none of these, which lists them and suggests one, or says whose is left out."""
        error = unknown_name(field, name := str(name), self)
        absent = f"No installed package offers it in {self.group}: docs/howto/extend.md."
        advice = self._refused.get(name) or f"{error.advice} {absent}".lstrip()
        return NotInstalledError(field, error.rule, name, advice)

    def check(self, field: str, name: object) -> None:
        """Raise `NotInstalledError` unless there is one of this name."""
        if name not in self:
            raise self.unknown(field, name)


def _package(entry: EntryPoint) -> str:
    """The package of an entry point and its version."""
    return f"{entry.dist.name} {entry.dist.version}" if entry.dist else entry.value
