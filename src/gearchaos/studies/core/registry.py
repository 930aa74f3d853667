"""All kinds of studies by name, for study files, stores and the command line."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from importlib import import_module

from gearchaos import catalogue
from gearchaos.plugins import Register, class_of
from gearchaos.quantities import ask_if_unknown
from gearchaos.studies.core.study import Study


class _Studies(Mapping[str, type[Study]]):
    """The classes of studies by kind; each is imported when it is used."""

    def __getitem__(self, kind: str) -> type[Study]:
        entry = catalogue.STUDIES[kind]
        return getattr(import_module(f"gearchaos.{entry['module']}"), entry["class"])

    def __contains__(self, kind: object) -> bool:
        return kind in catalogue.STUDIES

    def __iter__(self) -> Iterator[str]:
        return iter(catalogue.STUDIES)

    def __len__(self) -> int:
        return len(catalogue.STUDIES)


STUDIES: Register[type[Study]] = Register("gearchaos.studies", _Studies(), class_of(Study, "kind"))
ask_if_unknown(STUDIES.take_in_all)


def study_class(kind: str) -> type[Study]:
    """The class of a kind of study; raises `NotInstalledError` for an unknown one."""
    STUDIES.check("study.kind", kind)
    return STUDIES[kind]
