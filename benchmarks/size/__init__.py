"""Memory, listings, threads and cost over size of the solver, beside an earlier commit."""
