"""Pages on studies whose settings should agree."""
