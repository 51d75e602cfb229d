# SPDX-License-Identifier: GPL-2.0-only
"""Set-up of Sphinx; tests/maintain/website.py calls it, which puts the pages of doc/ and those of other folders together first."""

import hashlib
import importlib.util
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "doc" / "_ext"), str(ROOT / "tools"), str(ROOT / "tests" / "maintain")]

import evp  # noqa: E402
from site_pages import pages  # noqa: E402

project = "EVP"
author = "the authors of EVP"
copyright = "the authors of EVP, GPL-2.0"  # noqa: A001  Sphinx' name
version = release = getattr(evp, "__version__", "")
root_doc = "index"
language = "en"
extensions = ["myst_parser", "sphinx_rtd_theme", "sphinx.ext.githubpages", "lammps_lexer", "mathml", "repository_links"]
if importlib.util.find_spec("sphinx_copybutton"):  # a button at each block of commands; who does not have it does without
    extensions.append("sphinx_copybutton")
repository_root = str(ROOT)
repository_pages = pages(ROOT)
source_suffix = {".rst": "restructuredtext", ".md": "markdown"}
smartquotes = False
myst_heading_anchors = 4
myst_enable_extensions = ["html_image"]
highlight_language = "default"
pygments_style = "default"
html_math_renderer = "mathml"
html_theme = "sphinx_rtd_theme"
html_theme_options = {"navigation_depth": 2, "prev_next_buttons_location": "both"}
html_title = f"EVP {release}".strip()
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
copybutton_selector = "div.highlight-bash pre, div.highlight-LAMMPS pre, div.highlight-lammps pre, div.highlight-python pre"


def setup(app):
    """Sphinx reads a page again when the page or the set-up has changed; our extensions are part of the set-up."""
    sources = b"".join(path.read_bytes() for path in sorted((ROOT / "doc" / "_ext").glob("*.py")))
    app.add_config_value("extension_sources", hashlib.sha256(sources).hexdigest(), "env")
