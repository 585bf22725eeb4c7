"""The report of a study: one HTML page, from the tables and snapshots of its runs."""
