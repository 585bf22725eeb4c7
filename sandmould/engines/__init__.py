"""One interface, several engines: sessions, outcomes, snapshots and the driver of a run."""
