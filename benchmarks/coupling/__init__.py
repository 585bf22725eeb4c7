"""Cost of coupling."""
