"""Studies of sand: grains on one of the engines."""
