"""Decks of the user's own: rendered, run as they are, and read by their log."""
