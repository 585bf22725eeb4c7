"""Whether an optimal frequency belongs to the sand: controls, and what they say together."""
