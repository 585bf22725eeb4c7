"""Calibration beside its peers: docs/developers/calibration_peers.md."""
