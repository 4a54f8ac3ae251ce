"""What a person sees: tables built from rows, nothing measured here."""
