"""What a distance does to wheel profiles, and what settings and models do to that."""
