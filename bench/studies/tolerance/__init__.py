"""`routes tolerance`: gradient error against solver tolerance."""
