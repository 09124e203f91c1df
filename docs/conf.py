"""How the guide is built: sphinx-build -W docs OUT (pip install 'nnhydro[docs]')."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "_ext"))

import nnhydro

project = "nnhydro"
author = copyright = "The nnhydro developers"
release = version = nnhydro.__version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.mathjax", "effect_pages"]
myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 3
html_theme = "furo"
html_title = "nnhydro"
exclude_patterns = ["_ext", "examples"]
autodoc_member_order = "bysource"
autodoc_typehints = "description"
default_role = "code"
suppress_warnings = ["config.cache"]
