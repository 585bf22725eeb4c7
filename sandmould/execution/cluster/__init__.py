"""A cluster with Slurm: what the user says of it, what it allows, and what waits and runs there."""
