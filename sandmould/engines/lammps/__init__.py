"""The LAMMPS engine: decks for ``pair_style granular``, run in process."""

OLDEST_VERSION = 20250722
"""First release with all parts of ``pair_style granular`` that the decks use."""
