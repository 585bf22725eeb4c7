"""What the papers claim beside what this program computes: docs/reproduction.md."""
