"""Thousands of runs: docs/workflow_cost.md."""
