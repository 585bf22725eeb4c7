"""Fit of a heap."""
