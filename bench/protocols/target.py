"""The foreign model that `umbridge:URL#MODEL` or `tesseract:FILE|URL` names."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from gradient_routes.bench.cases.folder import located
from gradient_routes.bench.protocols.forward import Forward
from gradient_routes.bench.protocols.tesseract import TesseractModel
from gradient_routes.bench.protocols.umbridge import UMBridge
from gradient_routes.problems.errors import InputError


def model_of(target: str, config: str | None) -> Forward:
    """Given the content of the file `config`. Raises InputError."""
    protocol, _, address = target.partition(":")
    given = None if config is None else _object(config)
    if protocol == "tesseract":
        return TesseractModel(address, given)
    url, _, name = address.partition("#")
    return UMBridge(url, name, given or {})


def _object(file: str) -> dict[str, Any]:
    try:
        found = json.loads(Path(located(file)).read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {error.strerror} - check the path") from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"{file}: is no JSON: {error} - correct it") from None
    if not isinstance(found, dict):
        raise InputError(f"{file}: is no JSON object - write {{...}}")
    return found
