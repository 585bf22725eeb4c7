"""What becomes of a study when processes are killed and disks fail."""
