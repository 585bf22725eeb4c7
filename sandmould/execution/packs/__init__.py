"""Finished runs that travel: packed into one file, unpacked on another machine, kept in records."""
