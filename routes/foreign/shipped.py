"""The adapters of this package as routes, one a line."""

from gradient_routes.routes.foreign.foreign import of_manifest
from gradient_routes.routes.foreign.manifest import ADAPTERS, manifest
from gradient_routes.routes.route import Route


def _route(name: str) -> Route:
    return of_manifest(manifest(ADAPTERS / f"{name}.py"))


jax = _route("jax")
lineax = _route("lineax")
taichi = _route("taichi")
torch = _route("torch")
torch_fem = _route("torch-fem")
warp = _route("warp")
warp_unrolled = _route("warp-unrolled")
dolfinx = _route("dolfinx")
jax_fem = _route("jax-fem")
feax = _route("feax")
dolfinx_adjoint = _route("dolfinx-adjoint")
