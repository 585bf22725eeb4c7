"""The staggered loop between sand and pattern: windows, relaxation, its own error."""
