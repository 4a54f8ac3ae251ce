"""A plug-in for gradient-routes: one problem, one route."""
