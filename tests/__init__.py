"""Tests, in a folder for each kind; CONTRIBUTING.md says which kind goes where."""
