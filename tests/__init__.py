"""Tests, in a folder for each kind; CONTRIBUTING.md says which kind goes where."""

from pathlib import Path

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples"
