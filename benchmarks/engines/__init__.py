"""Speed of the engines: docs/developers/speed.md."""
