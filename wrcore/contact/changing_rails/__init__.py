"""Rails that change along the track and wheels out of round, as a wheel sees them."""
