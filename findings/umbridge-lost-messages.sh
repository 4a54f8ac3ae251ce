#!/usr/bin/env bash
# Software:  umbridge 1.2.10 with aiohttp 3.14.5, requests 2.34.2 and numpy 2.4.6, Python 3.11
# Behaviour: serve_models() writes numbers as Python prints them: NaN becomes `nan`, which is no JSON. What a model raises
#            becomes HTTP 500 without its message. The client reads both as JSON, and raises JSONDecodeError. The server
#            listens at all addresses of the machine, without an option.
# Output:    nan: 200 {"output": [[nan]] }: client raises JSONDecodeError
#            raises: 500 500 Internal Server Error: client raises JSONDecodeError
#            listens at 0.0.0.0
# Used in:   bench/protocols/http.py, which reads nan; docs/how-to/umbridge-and-tesseract.md
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check umbridge==1.2.10 aiohttp==3.14.5 \
  requests==2.34.2 numpy==2.4.6 psutil==7.2.2
cd "$folder"
cat >server.py <<'SERVER'
import sys

import umbridge


class Model(umbridge.Model):
    def get_input_sizes(self, config):
        return [1]

    def get_output_sizes(self, config):
        return [1]

    def __call__(self, parameters, config):
        if self.name == "raises":
            raise ValueError("the mesh is tangled")
        return [[float("nan")]]

    def supports_evaluate(self):
        return True


umbridge.serve_models([Model("nan"), Model("raises")], int(sys.argv[1]))
SERVER
cat >program.py <<'PROGRAM'
import socket
import subprocess
import sys
import time

import psutil
import requests
import umbridge

with socket.socket() as free:
    free.bind(("127.0.0.1", 0))
    port = free.getsockname()[1]
server = subprocess.Popen([sys.executable, "server.py", str(port)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
try:
    for _ in range(600):
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", port)) == 0:
                break
        time.sleep(0.1)
    url, found = f"http://127.0.0.1:{port}", {}
    for name in ("nan", "raises"):
        answer = requests.post(f"{url}/Evaluate", json={"name": name, "input": [[1.0]], "config": {}})
        try:
            said = f"returns {umbridge.HTTPModel(url, name)([[1.0]])}"
        except Exception as error:
            said = f"raises {type(error).__name__}"
        found[name] = (answer.status_code, "nan" in answer.text, "tangled" in answer.text, said)
        print(f"{name}: {answer.status_code} {answer.text.splitlines()[0]}: client {said}")
    listening = {c.laddr.ip for c in psutil.Process(server.pid).net_connections("inet4") if c.status == "LISTEN"}
    print("listens at", *listening)
finally:
    server.terminate()
    server.wait()
assert found["nan"] == (200, True, False, "raises JSONDecodeError"), "it behaves otherwise now: change the page"
assert found["raises"] == (500, False, False, "raises JSONDecodeError"), "it behaves otherwise now: change the page"
assert listening == {"0.0.0.0"}, "it behaves otherwise now: change the page"
PROGRAM
venv/bin/python program.py
