"""The documentation site: `make docs`. Pages are Markdown; the reference is generated from the code's declarations."""

import runpy
from importlib import metadata
from pathlib import Path

HERE = Path(__file__).parent

project = "gradient-routes"
release = metadata.version("gradient-routes")
extensions = ["myst_parser"]
exclude_patterns = ["_build"]
myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 3
html_theme = "furo"
html_title = "gradient-routes"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_copyright = False
smartquotes = False  # --option stays as it is
suppress_warnings = ["misc.highlighting_failure"]  # console blocks hold printed output

runpy.run_path(str(HERE / "generated.py"))["write"]()
