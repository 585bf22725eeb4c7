"""What keeps a well-typed scene from being run."""
