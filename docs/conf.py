"""Configuration of the manual (`make docs`): Sphinx reads it. Nothing is fetched from another host."""

from __future__ import annotations

import os
import sys
from importlib.metadata import version as installed_version
from pathlib import Path

DOCS = Path(__file__).parent
sys.path.insert(0, str(DOCS / "_ext"))
os.environ.pop("MPLBACKEND", None)  # notebooks choose theirs, which shows pictures in the page

project = "gearchaos"
author = "The gearchaos developers"
copyright = author
version = release = installed_version("gearchaos")

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "numpydoc",
    "sphinx_design",
    "sphinx_copybutton",
    "mathml",
    "stale",
    "docstrings",
    "command_pages",
    "file_pages",
    "dataset_pages",
    "repository_pages",
]
GALLERY = DOCS / "gallery"
if any(GALLERY.glob("plot_*.py")):
    extensions.append("sphinx_gallery.gen_gallery")

templates_path = ["_templates"]
exclude_patterns = [
    "_ext", "_templates", "gallery", "**/sg_execution_times.rst", "sg_execution_times.rst",
    "generated/gallery/*.ipynb", "generated/gallery/*.py", "generated/gallery/*.md5", "generated/backreferences",
]
nitpicky = True
nitpick_ignore_regex = [
    (r"py:obj", r"gearchaos\..*|__post_init__"),  # `name` in a docstring that has no page of its own
    (r"py:obj", r"(dataclasses|xarray)\..*"),  # other projects' pages are on other hosts
]
suppress_warnings = ["config.cache"]  # the gallery's sort keys are functions, which Sphinx does not store

# Markdown
source_suffix = {".rst": "restructuredtext", ".md": "myst-nb"}
myst_enable_extensions = ["attrs_block", "colon_fence", "deflist", "dollarmath", "fieldlist"]
myst_heading_anchors = 4
highlight_language = "none"  # code without a named language is a command, a formula or printed text
html_math_renderer = "mathml"

# Tutorials: executed once, and again when their text or the kernel's outputs change
nb_execution_mode = "cache"
nb_execution_cache_path = str(DOCS.parent / "build" / "docs-notebooks")
nb_execution_raise_on_error = True
nb_execution_timeout = 120
nb_execution_show_tb = True
nb_merge_streams = True
nb_ipywidgets_js: dict[str, dict[str, str]] = {}  # the default loads scripts from other hosts

# Docstrings
default_role = "autolink"
autodoc_typehints = "none"  # numpydoc's lists of parameters have the types
autodoc_member_order = "bysource"
autosummary_generate = True
autosummary_imported_members = True
autosummary_filename_map = {  # names that differ from a function's in case alone would share a file on some systems
    f"gearchaos.{name}": f"gearchaos.{name}-class"
    for name in ("Attractors", "Basins", "Bifurcation", "Regime", "Simulate", "Zones")
}
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False

sphinx_gallery_conf = {
    "examples_dirs": str(GALLERY),
    "gallery_dirs": "generated/gallery",
    "filename_pattern": r"plot_",
    "backreferences_dir": "generated/backreferences",
    "doc_module": ("gearchaos",),
    "download_all_examples": False,
    "plot_gallery": "True",
    "abort_on_example_error": True,
    "only_warn_on_example_error": False,
    "remove_config_comments": True,
    "show_memory": False,
    "show_signature": False,
    "min_reported_time": 60,
    "thumbnail_size": (400, 280),
    "within_subsection_order": "gallery_order.GalleryOrder",
}

# Pages
html_theme = "pydata_sphinx_theme"
html_title = f"gearchaos {version}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_sidebars = {"start/index": [], "index": []}
html_copy_source = False
smartquotes = False  # an apostrophe after a symbol is a derivative, and two hyphens begin an option
html_show_sourcelink = False
html_use_index = True
html_theme_options = {
    "logo": {"text": "gearchaos"},
    "navbar_align": "left",
    "navbar_end": ["theme-switcher"],
    "header_links_before_dropdown": 7,
    "show_toc_level": 2,
    "navigation_with_keys": False,
    "footer_start": ["copyright"],
    "footer_end": [],
    "secondary_sidebar_items": ["page-toc"],
    "pygments_light_style": "a11y-high-contrast-light",
    "pygments_dark_style": "a11y-high-contrast-dark",
}
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True
