"""The reference engine: the in-house solver on a scenario."""
