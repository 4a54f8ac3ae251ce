"""Which route to take: predicted bills, reasons, what would change the answer; the literature and a glossary."""
