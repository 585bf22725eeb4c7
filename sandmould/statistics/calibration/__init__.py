"""Calibration of sands: what measured values say of two parameters."""
