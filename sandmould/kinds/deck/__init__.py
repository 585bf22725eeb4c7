"""Studies of a deck of the user's own."""
