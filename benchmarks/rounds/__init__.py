"""Rounds beside plain sweeps."""
