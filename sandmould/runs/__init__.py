"""What every run has, whatever computes it: outcome, cost, progress, checkpoint, provenance."""
