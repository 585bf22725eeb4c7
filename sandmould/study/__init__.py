"""Studies: how a file becomes runs, what they cost, what comes of them."""
