"""`routes run`: cost and error of every route."""
