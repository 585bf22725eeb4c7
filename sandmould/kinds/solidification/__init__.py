"""Studies of a casting that solidifies in its mould."""
