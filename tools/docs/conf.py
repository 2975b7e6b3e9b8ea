# SPDX-License-Identifier: Apache-2.0
"""The site of documents: Markdown of docs/ as it is, the C headers by Doxygen, the Python package by its docstrings.
`./dev docs` builds it into build-docs/html."""
import os
import pathlib
import re
import shutil
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]

project = "Waymark"
author = "The Waymark authors"
copyright = "The Waymark authors, Apache-2.0"  # noqa: A001 (Sphinx's name)
release = re.search(r"^project\(waymark VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text(), re.MULTILINE).group(1)

extensions = ["myst_parser", "sphinx_copybutton", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
root_doc = "docs/index"
include_patterns = ["docs/**.md", "README.md", "config/README.md", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md"]
exclude_patterns = ["build*", ".cache", ".git", "tests", "estimator", "firmware", "drivers", "msgs", "toolchain"]
myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 4
# YAML and shell of an example may hold a line that a lexer does not know.
suppress_warnings = ["misc.highlighting_failure"]

html_theme = "furo"
html_title = f"Waymark {release}"
html_static_path = [str(HERE / "static")]
html_css_files = ["waymark.css"]
html_favicon = str(HERE / "static/favicon.svg")
html_search_scorer = str(HERE / "static/scorer.js")
html_show_sourcelink = False
html_copy_source = False
html_theme_options = {"light_css_variables": {"color-brand-primary": "#1d5fa8", "color-brand-content": "#1d5fa8"},
                      "dark_css_variables": {"color-brand-primary": "#7fb2ea", "color-brand-content": "#7fb2ea"}}
copybutton_exclude = ".linenos, .gp, .go"

sys.path.insert(0, str(ROOT / "tools/python/src"))
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_mock_imports = ["cffi", "mcap", "mcap_ros2", "numpy", "PIL", "rosbags", "yaml"]

# ── C headers ───────────────────────────────────────────────────────────────────────────────────────────────────────
HEADERS = [ROOT / "firmware/library/include/waymark/waymark.h", ROOT / "msgs/include/waymark",
           ROOT / "estimator/include/waymark"]
# Comments are plain `//`: before a declaration they describe it, behind one the line.
FILTER = r"sed -E -e '/^\/\/ ──/d' -e 's|^( *)// ?|\1/// |' -e 's|([^ /].*[^ ]) +// |\1  ///< |'"


def doxygen(out):
    settings = {"INPUT": " ".join(map(str, HEADERS)), "OUTPUT_DIRECTORY": out, "GENERATE_XML": "YES", "GENERATE_HTML": "NO",
                "GENERATE_LATEX": "NO", "QUIET": "YES", "WARNINGS": "NO", "FILE_PATTERNS": "*.h", "OPTIMIZE_OUTPUT_FOR_C": "YES",
                "EXTRACT_ALL": "YES", "INPUT_FILTER": f'"{FILTER}"', "MACRO_EXPANSION": "YES", "EXPAND_ONLY_PREDEF": "YES",
                "PREDEFINED": '"_Static_assert(x,y)=" "__attribute__(x)=" "_Nonnull=" "WM_NODISCARD="',
                "JAVADOC_AUTOBRIEF": "YES", "TYPEDEF_HIDES_STRUCT": "YES", "AUTOLINK_SUPPORT": "NO"}
    text = "".join(f"{key} = {value}\n" for key, value in settings.items())
    subprocess.run(["doxygen", "-"], input=text, text=True, check=True)


if shutil.which("doxygen"):
    xml = pathlib.Path(os.environ["WM_DOCS_OUT"]) / "doxygen"
    xml.mkdir(parents=True, exist_ok=True)
    doxygen(xml)
    extensions.append("breathe")
    breathe_projects = {"waymark": str(xml / "xml")}
    breathe_default_project = "waymark"
    breathe_domain_by_extension = {"h": "c"}
    breathe_show_include = False
else:
    print("doxygen is not installed: the site has no reference of the C headers")
    exclude_patterns.append("docs/reference-c.md")
