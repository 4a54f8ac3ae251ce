"""The store: results in SQLite, append-only, exported and resumed from."""
