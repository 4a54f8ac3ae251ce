"""`routes check`: a verdict on anyone's gradient."""
