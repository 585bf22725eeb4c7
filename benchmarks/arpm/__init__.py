"""Ways to solidify: docs/solidification.md."""
