#!/usr/bin/env bash
# Software:  panel 1.9.4, bokeh 3.9.2, Python 3.11
# Behaviour: panel.serve calls functions and methods anew for each visitor, but no other callable: a functools.partial
#            is shown as a widget that lists its arguments, its own answer is never the page. There is no error and no
#            warning; state that should be one visitor's is then made once for all.
# Output:    function: is the page
#            partial of it: is not the page
# Used in:   bench/lab/server.py
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check panel==1.9.4 bokeh==3.9.2
cd "$folder"
cat >program.py <<'PROGRAM'
import functools

import panel as pn
from bokeh.document import Document
from panel.io.server import get_server

MADE = []


def page(kind):
    MADE.append(kind)
    template = pn.Template("<!doctype html>{{ embed(roots.main) }}")
    template.add_panel("main", pn.pane.HTML(kind))
    return template


pages = {"function": lambda: page("function"), "partial": functools.partial(page, "partial")}
server = get_server(pages, port=0, show=False, start=False)
for name in pages:
    document = server._tornado.applications[f"/{name}"].application.create_document()
    called = name in MADE and "template_resources" in document.template_variables
    print(f"{'partial of it' if name == 'partial' else name}: {'is' if called else 'is not'} the page")
    assert called == (name == "function"), f"it behaves otherwise now: {MADE}"
server.stop()
PROGRAM
venv/bin/python program.py
