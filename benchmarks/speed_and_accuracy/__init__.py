"""Error against core time of every method, from committed results."""
