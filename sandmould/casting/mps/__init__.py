"""Metal flow by MPS with improved multiple relaxation, after Hirata and Anzai 2017.

Arrays of vectors have three components here; in 2D the last is zero. Equation numbers are those of
the paper (Mater. Trans. 58, 479-484).
"""
