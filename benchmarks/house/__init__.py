"""The house itself: its rooms, its imports and its names."""
