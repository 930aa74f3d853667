"""Tests, in a folder for each kind; CONTRIBUTING.md says which kind goes where."""

from pathlib import Path

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples"
ONE_SPRING = ROOT / "tests" / "one_spring" / "spur_50_50.toml"
