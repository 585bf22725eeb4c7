"""From a study's file to its runs: reading, expanding, batches, the plan on disk."""
