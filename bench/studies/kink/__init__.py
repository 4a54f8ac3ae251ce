"""`routes kink`: dJ/dp where the active set of a contact changes."""
