"""Calibration beside its peers: docs/calibration_peers.md."""
