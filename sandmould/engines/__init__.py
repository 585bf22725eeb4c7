"""One interface, several engines: sessions, outcomes, snapshots and the driver that runs a scenario."""
