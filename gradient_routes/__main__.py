"""`python -m gradient_routes` is the command `routes`."""

from __future__ import annotations

from gradient_routes.bench.start import main

if __name__ == "__main__":
    main()
