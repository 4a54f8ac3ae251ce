"""A PyTorch module: the loss of a small network as a function of all its weights, and its gradient by autograd."""

import numpy as np
import torch

torch.manual_seed(0)
network = torch.nn.Sequential(torch.nn.Linear(2, 8), torch.nn.Tanh(), torch.nn.Linear(8, 1)).double()
x = torch.randn(30, 2, dtype=torch.float64)
y = torch.sin(x[:, :1]) * x[:, 1:]


class Loss:
    start = torch.nn.utils.parameters_to_vector(network.parameters()).detach().numpy()

    def value_and_gradient(self, p):
        torch.nn.utils.vector_to_parameters(torch.from_numpy(np.array(p)), network.parameters())
        network.zero_grad()
        loss = ((network(x) - y) ** 2).mean()
        loss.backward()
        return loss, torch.cat([q.grad.ravel() for q in network.parameters()])
