"""Errors and power of the comparison of settings."""
