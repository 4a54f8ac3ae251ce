"""Tables and plots in plain characters."""
