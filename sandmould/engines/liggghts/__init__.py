"""The LIGGGHTS engine: decks for ``pair_style gran``, run by Debian's executable."""

OLDEST_VERSION = "3.8.0"
"""Oldest release whose decks were checked."""
