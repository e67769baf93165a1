"""From a wheel's position and velocity to the forces of the rails on it: one file for each model of contact."""
