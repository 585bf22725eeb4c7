"""Whether the price that a plan tells is right."""
