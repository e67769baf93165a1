"""Settings of Sphinx. `build.py` lays out the sources that it reads."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from wrcore import __version__

project, author, release = "wrcore", "The wrcore developers", __version__
copyright = author
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "mathml"]
html_theme, html_title = "furo", f"wrcore {release}"
html_static_path, html_css_files = ["_static"], ["site.css"]
html_copy_source = html_show_sphinx = False
html_show_search_summary = False  # summaries are fetched, which pages opened as files may not do
exclude_patterns = ["_static"]

myst_enable_extensions = ["dollarmath", "deflist", "colon_fence"]
myst_heading_anchors = 4
myst_dmath_double_inline = True
math_eqref_format, numfig, numfig_secnum_depth = "({number})", True, 1  # equations of a page: (4.1), (4.2), ...
html_math_renderer = "mathml"

autodoc_typehints = "none"  # docstrings have units beside the types
autodoc_member_order = "bysource"
napoleon_google_docstring = False
napoleon_custom_sections = [("Fields", "params_style")]
napoleon_use_rtype = napoleon_use_param = False
add_module_names = False
smartquotes = False
toc_object_entries_show_parents = "hide"
nitpicky = False
suppress_warnings = ["misc.highlighting_failure", "config.cache"]


def _as_written(app, what, name, obj, options, lines):
    """Docstrings as reStructuredText: bars are sizes of numbers, not substitutions, and formulas, set off by blank
    lines and four blanks, stay as they are."""
    shown, literal = [], False
    for line in lines:
        begins = line.startswith("    ") and shown and not shown[-1].strip()
        above = next((earlier for earlier in reversed(shown) if earlier.strip()), "") if begins else ""
        if begins and not literal and above and not above.startswith(" "):
            shown += [] if above.endswith("::") else ["::", ""]
            literal = True
        elif line.strip() and not line.startswith("    "):
            literal = False
        shown.append(line if literal else line.replace("|", r"\|"))
    lines[:] = shown


def setup(app):
    app.connect("autodoc-process-docstring", _as_written, priority=100)
