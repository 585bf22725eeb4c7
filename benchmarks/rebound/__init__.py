"""Rebound by engine and step."""
