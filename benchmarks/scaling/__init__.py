"""Thousands of runs: docs/developers/workflow_cost.md."""
