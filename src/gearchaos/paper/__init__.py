"""The 2008 study end to end: `build` computes its figures and claims and writes the report."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gearchaos.paper.report import build

__all__ = ["build"]


def __getattr__(name: str) -> Any:
    """`build`, imported when it is asked for: the explorer wants the settings of the figures alone."""
    if name != "build":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from gearchaos.paper.report import build

    return build
