"""An adapter that misbehaves as its argument says. It needs nothing but Python, and starts fast.

python misbehaving.py KIND
"""

import base64
import json
import os
import signal
import struct
import sys
import time

KIND = sys.argv[1]
HUGE = 70_000_000  # bytes of a line, more than the harness reads of one


def array(numbers, name="float64", code="d"):
    data = struct.pack(f"<{len(numbers)}{code}", *numbers)
    return {name: [len(numbers)], "base64": base64.b64encode(data).decode()}


def write(text):
    sys.stdout.write(text)
    sys.stdout.flush()


def say(number, **said):
    write(json.dumps({"id": number} | said) + "\n")


def gradient(number, n):
    """The answer to `gradient`."""
    result = {"J": 1.0, "gradient": array([1.0] * n)}
    if KIND == "killed":
        os.kill(os.getpid(), signal.SIGKILL)
    elif KIND == "exits":
        sys.exit(3)
    elif KIND == "hangs":
        time.sleep(3600)
    elif KIND == "babbles":
        write("iteration 1: |R| = 3.2e-1\n")
    elif KIND == "babbles-a-huge-line":
        write("x" * HUGE + "\n")
    elif KIND == "half-a-frame":
        write(json.dumps({"id": number, "result": result | {"gradient": {"float64": [n], "frame": 8 * n}}}) + "\n")
        write("half")
        sys.exit(0)
    elif KIND == "another-id":
        number += 1
    elif KIND == "no-object":
        return write("[1, 2]\n")
    elif KIND == "no-base64":
        result["gradient"] = {"float64": [n], "base64": "*"}
    elif KIND == "nan":
        result["gradient"] = array([1.0] * (n - 1) + [float("nan")])
    elif KIND in ("nearly-J", "wrong"):  # the J of the bar, nearly or quite, and no gradient of it
        result["J"] = 0.00878072611104688 * (1.005 if KIND == "nearly-J" else 1.0)
    elif KIND == "infinite-J":
        result["J"] = float("inf")
    elif KIND == "endless-J":
        result["J"] = 10**400
    elif KIND == "text-J":
        result["J"] = "0.5"
    elif KIND == "wrong-length":
        result["gradient"] = array([1.0] * (n + 1))
    elif KIND == "wrong-shape":
        result["gradient"] = array([1.0] * n) | {"float64": [1, n]}
    elif KIND == "short":
        result["gradient"]["float64"] = [n + 1]
    elif KIND == "integers":
        result["gradient"] = array([1] * n, "int64", "q")
    elif KIND == "float32":
        result["gradient"] = array([1.0] * n, "float32", "f")
    elif KIND == "complex":
        result["gradient"] = array([1.0] * (2 * n), "complex128") | {"complex128": [n]}
    elif KIND == "a-list":
        result["gradient"] = [1.0] * n
    elif KIND == "warms-up":  # and says the number of its request for seconds
        result |= {"forward_s": number, "compile_s": number}
    elif KIND == "negative-seconds":
        result["forward_s"] = -1.0
    elif KIND == "nan-residual":
        result["residual"] = float("nan")
    elif KIND in ("not-converged", "singular", "domain", "memory", "unsupported", "bug"):
        return say(number, error={"kind": KIND, "message": "as it is\ntold"})
    return say(number, result=result)


for line in sys.stdin:
    asked = json.loads(line)
    method, number = asked["method"], asked["id"]
    if method == "describe":
        about = {"protocol": 2 if KIND == "another-version" else 1, "name": KIND}
        say(number, result=about | ({"versions": {"it": [1, 2]}} if KIND == "another-J" else {}))
    elif method == "load" and KIND == "dies-during-load":
        os._exit(1)
    elif method == "load" and KIND == "no-such-case":
        say(number, error={"kind": "unsupported", "message": "it knows no bar"})
    elif method == "gradient":
        gradient(number, asked["p"]["float64"][0])
    else:
        say(number, result={})
        if method == "bye":
            break
