"""Floor 3, the bench: measures routes on problems, judges gradients, keeps the rows, shows them."""
