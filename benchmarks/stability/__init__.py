"""Where the time step fails: docs/stability.md."""
