"""Draw the pictures of the README, six of the gallery: python docs/readme_pictures.py."""

from __future__ import annotations

import runpy
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

DOCS = Path(__file__).parent
SHOWN = ("which_speeds_to_avoid", "which_motion_is_where", "how_does_chaos_begin", "what_divides_these_basins",
         "where_does_the_resonance_jump", "what_shape_has_chaos")
WIDTH = 440
"""Width of a picture in pixels."""


def draw(name: str) -> Path:
    """Run a script of the gallery, and save its first figure."""
    plt.close("all")
    runpy.run_path(str(DOCS / "gallery" / f"plot_{name}.py"), run_name="__main__")
    figure, path = plt.figure(plt.get_fignums()[0]), DOCS / "pictures" / f"{name}.png"
    path.parent.mkdir(exist_ok=True)
    figure.savefig(path, dpi=WIDTH / figure.get_size_inches()[0])
    return path


if __name__ == "__main__":
    for name in SHOWN:
        print(draw(name))
