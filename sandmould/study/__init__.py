"""Studies: what is swept, how it becomes runs, and what the runs say together."""
