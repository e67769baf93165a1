"""Static equilibrium, steady running and initial state of a vehicle."""
