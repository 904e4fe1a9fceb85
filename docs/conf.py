# SPDX-License-Identifier: MIT
"""The documentation site: Sphinx with MyST. `./run docs` builds it into build/docs/html."""

import sys
from pathlib import Path

import openmmpse

sys.path.insert(0, str(Path(__file__).parent / "extensions"))

project = "openmmpse"
author = "the openmmpse developers"
copyright = author
release = version = openmmpse.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.mathjax",
    "sphinx.ext.napoleon",
    "sphinx-mathjax-offline",  # formulas without a network
    "crosslinks",
    "plaindocstrings",
    "reference",
]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
nitpicky = True
smartquotes = False  # options begin with two dashes
# Names of others (OpenMM, NumPy, plain words in the type of an argument) are not links; ours must be.
nitpick_ignore_regex = [("py:.*", r"(?!openmmpse\b).*")]
default_role = "py:obj"  # what docstrings put between single backticks: code, and a link where it is a name

toc_object_entries_show_parents = "hide"
autodoc_member_order = "bysource"
autodoc_typehints = "none"
napoleon_google_docstring = False
napoleon_use_rtype = False

html_theme = "furo"
html_title = f"openmmpse {release}"
html_show_copyright = False
html_show_sphinx = False
html_copy_source = False
html_static_path = ["static"]
html_css_files = ["layout.css"]
