"""Studies: what is swept, how it becomes runs, and how these are computed."""
