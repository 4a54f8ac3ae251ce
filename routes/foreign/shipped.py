"""The adapters of this package as routes: `torch_fem` is that of adapters/torch-fem.py."""

from functools import cache

from gradient_routes.routes.foreign.foreign import of_manifest
from gradient_routes.routes.foreign.manifest import manifest, shipped
from gradient_routes.routes.route import Route


@cache
def __getattr__(name: str) -> Route:
    script = shipped().get(name.replace("_", "-"))
    if script is None:
        raise AttributeError(f"no adapter {name}")
    return of_manifest(manifest(script))
