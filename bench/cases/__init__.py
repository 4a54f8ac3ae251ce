"""Cases: selectors, options, the registry, and the row that each case becomes."""
