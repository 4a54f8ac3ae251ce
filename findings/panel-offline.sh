#!/usr/bin/env bash
# Software:  panel 1.9.4, bokeh 3.9.2, Python 3.11
# Behaviour: what Panel ships to work without a network does not suffice for it. (1) extension(inline=True) puts its
#            scripts into a notebook, but its components still name style sheets on cdn.holoviz.org. (2) The KaTeX that
#            is bundled for formulas has its style sheet, but none of the fonts that this names: 20 files of each kind.
# Output:    inline: style sheets on cdn.holoviz.org: True
#            KaTeX: 20 fonts named, 0 shipped
# Used in:   gradient_routes/lab.py, bench/lab/formula.py
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check panel==1.9.4 bokeh==3.9.2
cd "$folder"
cat >program.py <<'PROGRAM'
import re
from pathlib import Path

import panel as pn

pn.extension(inline=True)
model = pn.Column(pn.widgets.FloatSlider(name="x")).get_root()
sheets = [sheet.url for part in model.select({}) for sheet in getattr(part, "stylesheets", []) if hasattr(sheet, "url")]
remote = any("cdn.holoviz.org" in url for url in sheets)
print(f"inline: style sheets on cdn.holoviz.org: {remote}")
assert remote, "it behaves otherwise now"

(katex,) = (Path(pn.__file__).parent / "dist" / "bundled" / "katex").rglob("katex.min.css")
named = set(re.findall(r"url\((fonts/[^)]+\.woff2)\)", katex.read_text()))
shipped = [name for name in named if (katex.parent / name).exists()]
print(f"KaTeX: {len(named)} fonts named, {len(shipped)} shipped")
assert (len(named), len(shipped)) == (20, 0), "it behaves otherwise now"
PROGRAM
venv/bin/python program.py
