"""Thousands of runs: docs/scaling.md."""
