"""What is simulated: the typed scenario, its sand and its materials."""
