"""What is simulated: the typed scenario, its geometry, its sand and its materials."""
