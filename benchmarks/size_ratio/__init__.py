"""Small grains between large ones: what the plane of the slip does."""
