"""Studies of metal that flows."""
