"""Whether two states of the house compute the same digits."""
