"""From gradients to answers: J minimized with any route as the engine."""
