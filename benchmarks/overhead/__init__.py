"""What is not the engine."""
