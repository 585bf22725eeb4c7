"""What the runs of a study say together: tables in, verdicts out."""
