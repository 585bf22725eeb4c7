"""Ways to let metal flow: docs/metal_flow.md."""
