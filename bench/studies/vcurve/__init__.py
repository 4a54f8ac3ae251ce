"""`routes vcurve`: difference quotients over decades of steps against a route's gradient."""
