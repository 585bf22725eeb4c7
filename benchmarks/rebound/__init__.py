"""Rebound by engine, damping ratio and step, and what it does to a bed."""
