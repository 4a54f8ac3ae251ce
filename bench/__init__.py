"""Floor 3, the bench: measures routes on problems, keeps the rows, shows them."""
