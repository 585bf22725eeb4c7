"""The solver's step loop against that of an earlier commit."""
