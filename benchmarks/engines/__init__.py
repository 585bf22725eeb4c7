"""Speed of the engines: docs/speed.md."""
