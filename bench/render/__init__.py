"""Tables, figures and reports from rows. Nothing is measured here."""
