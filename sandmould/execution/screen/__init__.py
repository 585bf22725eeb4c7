"""What a person sees of a study that is being computed."""
