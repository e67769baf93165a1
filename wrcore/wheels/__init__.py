"""Forces of the rails on a wheel from its position and velocity: one file for each contact model."""
