"""What PyTorch's autograd keeps between its sweeps, for adapters."""

import torch


def saved_bytes(call):
    """What autograd keeps for backward(), each storage once."""
    saved = {}

    def save(x):
        saved[x.untyped_storage().data_ptr()] = x.untyped_storage().nbytes()
        return x

    with torch.autograd.graph.saved_tensors_hooks(save, lambda x: x):
        kept = call()
    del kept
    return sum(saved.values())
