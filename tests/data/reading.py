"""Command lines, as JSON on stdin, called in this process; what came of each, as JSON on stdout."""

from __future__ import annotations

import json
import sys

from click.testing import CliRunner

from gradient_routes.bench.cli import main

found = []
for words in json.load(sys.stdin):
    done = CliRunner().invoke(main, words)
    found.append((done.exit_code, done.stdout, done.stderr))
json.dump(found, sys.stdout)
