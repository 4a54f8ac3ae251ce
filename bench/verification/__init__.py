"""Is this gradient right? Difference quotients over many steps, a verdict, and evidence that needs no step."""
