"""Which route to take: predicted bills, reasons, what would change the answer; the literature and a glossary."""

HAVE = ("value", "solve", "linearize", "trace", "complex")  # what can be evaluated, as options name it
