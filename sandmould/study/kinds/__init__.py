"""Kinds of studies: what is simulated, and what each kind can be asked."""
