"""Particle methods of casting: solidification and flow."""
