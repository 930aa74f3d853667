"""The 2008 study end to end: `build` computes its figures and claims and writes the report."""

from gearchaos.paper.report import build

__all__ = ["build"]
