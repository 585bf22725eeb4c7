"""One interface, several engines: decks, sessions, snapshots and the driver of a run."""
