"""Deformation of the foam pattern under the sand; holds nothing until the pattern is computed."""
