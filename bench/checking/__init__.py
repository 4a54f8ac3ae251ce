"""Is this gradient right? Difference quotients over many steps, what they say, and evidence that needs no step."""
