"""The adapters of this package as routes: `torch_fem` is that of adapters/torch-fem.py."""

from functools import cache

from gradient_routes.routes.foreign.foreign import of_manifest
from gradient_routes.routes.foreign.manifest import ADAPTERS, manifest
from gradient_routes.routes.route import Route


@cache
def __getattr__(name: str) -> Route:
    script = ADAPTERS / f"{name.replace('_', '-')}.py"
    if not script.is_file():
        raise AttributeError(f"no adapter {script.stem}")
    return of_manifest(manifest(script))
