"""A study as it is written: its typed sections, its sweep, and what is wrong with them."""
